#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace vivant {

/// A painting and its share in a mixture of styles; only the ratios of the weights count.
struct StyleShare {
  std::filesystem::path picture;
  double weight = 1;
  bool operator==(const StyleShare&) const = default;
};

/// Styles that are mixed; none: as the fields render it.
using StyleMixture = std::vector<StyleShare>;

/// The mixture that a user writes as "painting.jpg", "painting.jpg:0.7" for each share, or "none" alone.
/// Throws UsageError for a weight that is not above 0, and for "none" among others.
StyleMixture mixture_from(const std::vector<std::string>& texts);

enum class Layer { scene, person };

/// How a film is painted.
struct Look {
  StyleMixture person, scene;  ///< equal ones: the picture is painted as a whole
  double strength = 1;         ///< 0: the reconstruction, 1: the whole style (film_stylizer.hpp)
  bool keep_colour = false;    ///< the painting's luma, the reconstruction's chroma
  double brushwork = 1;        ///< of the paintings on the surfaces (brushwork.hpp); 0: none, as in the paper

  /// The same style for both layers.
  static Look whole(const StyleMixture& style) { return {style, style}; }
  const StyleMixture& mixture(Layer layer) const { return layer == Layer::person ? person : scene; }
  bool stylised() const { return !person.empty() || !scene.empty(); }
  bool layered() const { return person != scene; }
};

/// Checks that the look can be used in a film of these layers ("both", "scene", "human"), with or without a
/// person: the pictures can be read, and no layer has a style of its own that the film does not show. Throws
/// Error or UsageError.
void check_look(const Look& look, const std::string& layers, bool has_person);

}  // namespace vivant
