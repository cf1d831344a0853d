#pragma once
#include <cstddef>
#include <string>

namespace vivant {

/// The number of insertions, deletions and replacements from `a` to `b` (Levenshtein).
std::size_t edit_distance(const std::string& a, const std::string& b);

}  // namespace vivant
