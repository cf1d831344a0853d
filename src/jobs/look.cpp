#include "vivant/jobs/look.hpp"

#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string_view>

#include "vivant/io/image.hpp"
#include "vivant/runtime/error.hpp"

namespace vivant {
namespace {

/// The number that the whole text is, or none.
std::optional<double> number_from(std::string_view text) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

StyleShare share_from(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) return {text};
  const auto weight = number_from(std::string_view(text).substr(colon + 1));
  const bool picture_before = std::filesystem::is_regular_file(text.substr(0, colon));
  if (!weight && !picture_before) return {text};  // a colon of the file's name
  if (!weight || !(*weight > 0) || !std::isfinite(*weight) || colon == 0)
    throw UsageError(fmt::format("a style is IMAGE or IMAGE:WEIGHT with a weight above 0, not '{}'", text));
  return {text.substr(0, colon), *weight};
}

}  // namespace

StyleMixture mixture_from(const std::vector<std::string>& texts) {
  if (texts == std::vector<std::string>{"none"}) return {};
  StyleMixture mixture;
  for (const std::string& text : texts) {
    mixture.push_back(share_from(text));
    if (mixture.back().picture == "none")
      throw UsageError("the style 'none' stands alone: it cannot be mixed");
  }
  return mixture;
}

void check_look(const Look& look, const std::string& layers, bool has_person) {
  for (const StyleMixture* mixture : {&look.person, &look.scene})
    for (const StyleShare& share : *mixture) inspect_image(share.picture);
  if (!look.layered()) return;
  if (!look.person.empty() && (layers == "scene" || !has_person))
    throw UsageError("the person has a style of its own, but the film shows no person");
  if (!look.scene.empty() && layers == "human")
    throw UsageError("the scene has a style of its own, but the film shows the person alone");
}

}  // namespace vivant
