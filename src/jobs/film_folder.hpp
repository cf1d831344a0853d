#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>

namespace vivant {

/// The numbered pictures of a film that may take several calls to make, and what they were made with
/// (film.json), so that pictures made with different settings are never mixed.
class FilmFolder {
 public:
  /// Makes the folder, or goes on with it. `settings` is a flat JSON object. Throws Error, naming the first
  /// setting that differs, when the pictures there were made with others, and for a folder with other
  /// content.
  FilmFolder(std::filesystem::path folder, const nlohmann::ordered_json& settings);

  std::filesystem::path picture(int frame) const;
  std::filesystem::path film() const;
  bool has_picture(int frame) const { return std::filesystem::exists(picture(frame)); }
  bool has_film() const { return std::filesystem::exists(film()); }

  /// Makes the film of the first `count` pictures.
  void write_film(int count, double fps) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace vivant
