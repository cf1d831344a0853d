#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <opencv2/core.hpp>

#include "vivant/jobs/open_run.hpp"
#include "vivant/jobs/report.hpp"

namespace vivant {

/// How alike two pictures are, over all pixels or those of a region.
struct RegionScore {
  double psnr = 0, ssim = 0;
  std::optional<double> stlpips;  ///< ST-LPIPS, not LPIPS; pictures below StLpips::smallest_side have none
};

struct FrameScore {
  std::string frame;
  RegionScore full;  ///< of a run without a person: the pixels outside of the mask
  std::optional<RegionScore> person, background;  ///< inside and outside of the mask
  std::optional<double> silhouette_iou;           ///< of alpha > 1/2 and the mask
  /// Of the mask and the bare body in the pose that was given: below 1 by clothes, hair, what is held and the
  /// pose's error; without the latter two what evaluate_motion would say of a person without a fault.
  std::optional<double> body_iou;
};

/// How well a run renders pictures that it was not trained on.
struct Evaluation {
  std::vector<FrameScore> frames;
  FrameScore mean;                       ///< of the frames that have a score
  std::vector<cv::Mat> rendered, truth;  ///< the frames' pictures, CV_8UC3 RGB
  double fps = 24;                       ///< of the truth
  std::int64_t fitted_steps = 0;         ///< of the poses; 0: they are as given

  Report report() const;
  nlohmann::ordered_json json() const;
};

struct EvaluationOptions {
  std::filesystem::path truth = {};  ///< another capture of the same world and person; empty: the run's own
  std::int64_t fit_pose_steps = 0;   ///< fit_held_out_codes first, without `truth` alone; 0: do not
};

/// Renders frames and compares them with their pictures: the held-out frames of the run's own capture, or all
/// frames of `truth` when it is given. Whole frames when the
/// run has a person; else the pixels of the mask are left out.
///
/// In the truth an instant of the run's capture (known by the values of its pose) keeps its codes, other
/// poses have the novel codes, and colours do not depend on the view direction, since its views are new.
///
/// Throws Error when pictures are missing, when the truth shows no body of the person's joints, and those of
/// fit_held_out_codes; UsageError for poses fitted to another truth.
Evaluation evaluate(Device& device, const OpenRun& run, const EvaluationOptions& options, Progress& progress);

/// Writes both films as .mp4, report.json, report.md and index.html into a folder.
void write_evaluation(const std::filesystem::path& folder, const Evaluation& evaluation);

}  // namespace vivant
