#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "vivant/jobs/film.hpp"
#include "vivant/jobs/report.hpp"
#include "vivant/jobs/silhouette_scores.hpp"

namespace vivant {

/// A frame that shows fewer pixels of the body says nothing: the silhouette's border is much of it.
constexpr int least_body_pixels = 300;

/// How a rendered silhouette agrees with the posed body's; nothing in a frame that shows too little of it.
struct MotionFrameScore {
  std::optional<double> silhouette_iou;
  std::optional<LimbCover> least_limb;
  std::optional<double> detached;
};

/// How well a run's person keeps to their body in poses of which there are no pictures.
struct MotionEvaluation {
  std::vector<MotionFrameScore> frames;

  Report report() const;
  nlohmann::ordered_json json() const;
};

/// Renders the person of `run` alone in every frame of a film in the scene of `scene`, which may be the same
/// run, and compares their silhouette (alpha > 1/2) with that of the posed body: what stands before the
/// person in the scene is no fault. With an output folder also renders the film itself and writes it as .mp4,
/// plain and with the body's outline, report.json, report.md and index.html.
///
/// Throws UsageError as plan_film does, among others for a run without a person; Error when no frame shows
/// enough of the person.
MotionEvaluation evaluate_motion(Device& device, const OpenRun& run, const OpenRun& scene,
                                 const FilmOptions& options, const std::filesystem::path& output,
                                 Progress& progress);

}  // namespace vivant
