// The options of films, which several commands have.
#pragma once
#include <CLI/CLI.hpp>

#include "vivant/jobs/film.hpp"
#include "vivant/jobs/look.hpp"

namespace vivant::app {

/// What a film shows. Returns the option --views.
CLI::Option* add_film(CLI::App& command, FilmOptions& film, std::filesystem::path& scene);

/// The styles as they are written on the command line.
struct StyleTexts {
  std::vector<std::string> both, person, scene;

  /// To be called before the look is used.
  void apply(Look& look) const;
};
/// How it is painted.
void add_look(CLI::App& command, Look& look, StyleTexts& styles);

}  // namespace vivant::app
