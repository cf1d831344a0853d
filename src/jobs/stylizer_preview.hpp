#pragma once
#include <filesystem>

#include "jobs/stylizer_training.hpp"

namespace vivant {

/// A contact sheet: each row has a photograph, its reconstruction and, `with_styles`, the photograph in the
/// styles that stand above the columns: paintings kept unseen first.
void write_preview(const StylizerTraining& training, const std::filesystem::path& path, bool with_styles);

}  // namespace vivant
