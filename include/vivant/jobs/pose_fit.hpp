#pragma once
#include <cstdint>
#include <vector>

#include "vivant/jobs/open_run.hpp"
#include "vivant/jobs/progress.hpp"

namespace vivant {

/// The frame codes of held-out frames (the corrections of bones and of E), fitted to their pictures and masks
/// while the fields stay as they are: element i is of `run.capture.held_out_frames()[i]`. They start between
/// those of the neighbours in time, as `captured_state` has them. What is rendered with them is not held out
/// any more; it tells how much of the person's error comes, at most, from the poses that were given.
///
/// Throws Error for a run without a person, and for one that learns no corrections.
std::vector<HumanModel::CodeRow> fit_held_out_codes(Device& device, const OpenRun& run, std::int64_t steps,
                                                    Progress& progress);

}  // namespace vivant
