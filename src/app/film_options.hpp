// The options of films, which several commands have.
#pragma once
#include <CLI/CLI.hpp>

#include "vivant/jobs/film.hpp"
#include "vivant/jobs/look.hpp"

namespace vivant::app {

/// What a film shows. Returns the option --views.
CLI::Option* add_film(CLI::App& command, FilmOptions& film, std::filesystem::path& scene);

/// Throws UsageError, "NAME WHY", for the first of these options that was given.
void refuse_options(const CLI::App& command, std::initializer_list<const char*> names,
                    const std::string& why);
/// Throws UsageError for an option of a film or a style that says nothing about this one.
void refuse_unused(const CLI::App& command, const FilmOptions& film, const Look& look);

/// The styles as they are written on the command line.
struct StyleTexts {
  std::vector<std::string> both, person, scene;

  /// To be called before the look is used.
  void apply(Look& look) const;
};
/// How it is painted.
void add_look(CLI::App& command, Look& look, StyleTexts& styles);

}  // namespace vivant::app
