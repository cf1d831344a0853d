#pragma once
#include <filesystem>
#include <string>

#include "vivant/jobs/progress.hpp"
#include "vivant/runtime/device.hpp"

namespace vivant {

/// The weights of a form that come with the program; for plain, which has none, those of guided: loading
/// refuses them.
std::filesystem::path shipped_stylizer(const std::string& form);

struct StylisePicturesOptions {
  std::filesystem::path input;     ///< a video or a folder of pictures
  std::filesystem::path style;     ///< the painting
  std::filesystem::path stylizer;  ///< weights of this form; empty: those in assets, for guided and cosine
  std::string form = "guided";     ///< what the weights were trained as, see StylizerOptions::of_form
  std::int64_t tokens = 4096;      ///< of the style, at most
  std::filesystem::path output;    ///< folder for pictures, by the numbers of the frames
};

/// Paints each picture by itself: VGG-19 features of the picture, AdaAttN with statistics of the picture, the
/// decoder. This is the two-dimensional baseline of the paper's comparisons, which knows nothing of the
/// frames before and of the scene. The pictures of AdaAttN's own forms are left as they are; guided ones have
/// their colours matched by the first one. Throws Error when the weights are of another form.
void stylise_pictures(Device& device, const StylisePicturesOptions& options, Progress& progress);

}  // namespace vivant
