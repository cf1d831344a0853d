// load_batch: a jobs file to jobs.
#include <functional>
#include <map>
#include <set>

#include "jobs/spelling.hpp"
#include "jobs/toml_text.hpp"
#include "vivant/io/atomic_file.hpp"
#include "vivant/jobs/batch.hpp"
#include "vivant/jobs/values.hpp"

namespace vivant {
namespace {

namespace fs = std::filesystem;

constexpr const char* own_motion = "own";

/// What a [[job]] says.
struct JobText {
  std::string name, output = "films", scene, layers = "both", motion_names;
  std::vector<std::string> run, views, motion = {own_motion};  // these and `style` multiply
  std::vector<StyleMixture> style = {{}};
  std::optional<StyleMixture> person_style, scene_style;
  FilmOptions film;
  double strength = 1, brushwork = 1;
  bool keep_colour = false;
};

bool read(std::string& target, const toml::node& node) {
  if (!node.is_string()) return false;
  target = **node.as_string();
  return !target.empty();
}
bool read(std::vector<std::string>& target, const toml::node& node) {
  target.assign(1, "");
  if (!node.is_array()) return read(target[0], node);
  target.clear();
  for (const toml::node& element : *node.as_array())
    if (!read(target.emplace_back(), element)) return false;
  return !target.empty();
}
/// A text, or a list of them: the shares of a mixture.
bool read(StyleMixture& target, const toml::node& node) {
  std::vector<std::string> texts;
  if (!read(texts, node)) return false;
  target = mixture_from(texts);
  return true;
}
bool read(std::vector<StyleMixture>& target, const toml::node& node) {
  target.assign(1, {});
  if (!node.is_array()) return read(target[0], node);
  target.clear();
  for (const toml::node& element : *node.as_array())
    if (!read(target.emplace_back(), element)) return false;
  return !target.empty();
}
bool read(double& target, const toml::node& node, double lowest, double highest) {
  if (!node.is_number()) return false;
  target = *node.value<double>();
  return target >= lowest && target <= highest;
}
/// A text through a function that throws UsageError for what it does not understand.
template <typename Target, typename Function>
bool read_as(Target& target, const toml::node& node, Function&& function) {
  std::string text;
  if (!read(text, node)) return false;
  target = function(text);
  return true;
}

struct JobKey {
  const char* expected;
  std::function<bool(JobText&, const toml::node&)> read;
};

const std::map<std::string, JobKey>& job_keys() {
  using Node = const toml::node&;
  static const char* const text = "a text";
  static const char* const texts = "a text or a list of texts";
  static const std::map<std::string, JobKey> keys = {
      {"name", {text, [](JobText& job, Node node) { return read(job.name, node); }}},
      {"output", {text, [](JobText& job, Node node) { return read(job.output, node); }}},
      {"run", {texts, [](JobText& job, Node node) { return read(job.run, node); }}},
      {"views",
       {texts,
        [](JobText& job, Node node) {
          if (!read(job.views, node)) return false;
          for (const std::string& views : job.views) check_views(views);
          return true;
        }}},
      {"orbit_angle",
       {"a number of degrees from -360 to 360",
        [](JobText& job, Node node) { return read(job.film.orbit_angle, node, -360, 360); }}},
      {"orbit_frames",
       {"a whole number from 1 to 100000",
        [](JobText& job, Node node) {
          double number = 0;
          if (!node.is_integer() || !read(number, node, 1, 100000)) return false;
          job.film.orbit_frames = static_cast<int>(number);
          return true;
        }}},
      {"motion", {texts, [](JobText& job, Node node) { return read(job.motion, node); }}},
      {"motion_names", {text, [](JobText& job, Node node) { return read(job.motion_names, node); }}},
      {"style",
       {"a text, or a list of texts and of lists of texts, which are mixtures",
        [](JobText& job, Node node) { return read(job.style, node); }}},
      {"person_style",
       {texts, [](JobText& job, Node node) { return read(job.person_style.emplace(), node); }}},
      {"scene_style", {texts, [](JobText& job, Node node) { return read(job.scene_style.emplace(), node); }}},
      {"keep_colour",
       {"true or false",
        [](JobText& job, Node node) {
          if (node.is_boolean()) job.keep_colour = **node.as_boolean();
          return node.is_boolean();
        }}},
      {"strength",
       {"a number from 0 to 1", [](JobText& job, Node node) { return read(job.strength, node, 0, 1); }}},
      {"brushwork",
       {"a number from 0 to 2", [](JobText& job, Node node) { return read(job.brushwork, node, 0, 2); }}},
      {"scene", {text, [](JobText& job, Node node) { return read(job.scene, node); }}},
      {"place",
       {"a text, such as \"0.5,0,-1,90\"",
        [](JobText& job, Node node) {
          return read_as(job.film.place, node, [](const std::string& text) { return place_from(text); });
        }}},
      {"layers",
       {"both, scene or human",
        [](JobText& job, Node node) {
          return read(job.layers, node) &&
                 (job.layers == "both" || job.layers == "scene" || job.layers == "human");
        }}},
      {"size",
       {"a text, such as \"480x270\"",
        [](JobText& job, Node node) { return read_as(job.film.size, node, size_from); }}},
      {"frames",
       {"a text, such as \"0:24\"",
        [](JobText& job, Node node) { return read_as(job.film.frames, node, frame_range_from); }}},
  };
  return keys;
}

[[noreturn]] void refuse_key(const std::string& name, const std::string& where) {
  std::string nearest = "job";
  for (const auto& [key, unused] : job_keys())
    if (edit_distance(name, key) < edit_distance(name, nearest)) nearest = key;
  throw UsageError(fmt::format("{}: unknown key '{}': did you mean '{}'?", where, name, nearest));
}

/// Takes over the keys of a table, of which `apart` is none of a job.
void apply(JobText& job, const toml::table& table, const std::string& apart, const std::string& source) {
  for (const auto& [key, node] : table) {
    const std::string name(key.str()), where = line_of(node, source);
    if (name == apart) continue;
    const auto known = job_keys().find(name);
    if (known == job_keys().end()) refuse_key(name, where);
    try {
      if (!known->second.read(job, node))
        throw UsageError(fmt::format("it must be {}, not {}", known->second.expected, text_of(node)));
    } catch (const UsageError& error) {
      throw UsageError(fmt::format("{}: {}: {}", where, name, error.what()));
    }
  }
}

/// The file's name without its ending; of a folder its name.
std::string stem(const std::string& path) { return fs::path(path).lexically_normal().stem().string(); }

std::string run_name(const std::string& run) {
  const fs::path path = fs::path(run).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

/// The film of a style: `folder` is its name without the style.
BatchFilm film_of(const JobText& text, const StyleMixture& style, const fs::path& folder,
                  const fs::path& base) {
  Look look{text.person_style.value_or(style), text.scene_style.value_or(style), text.strength,
            text.keep_colour, text.brushwork};
  const auto name_of = [](const StyleMixture& mixture) {
    std::string name = mixture.empty() ? "-none" : "";
    for (const StyleShare& share : mixture) name += "-" + stem(share.picture.string());
    return name;
  };
  std::string name = folder.string();
  if (look.layered())
    name += "-person" + name_of(look.person) + "-scene" + name_of(look.scene);
  else if (look.stylised())
    name += name_of(look.scene);
  for (StyleMixture* mixture : {&look.person, &look.scene})
    for (StyleShare& share : *mixture) share.picture = base / share.picture;
  return {name, look};
}

/// One job for each run, views and motion, with a film for each style.
std::vector<BatchJob> multiplied(const JobText& text, const fs::path& base) {
  std::vector<BatchJob> jobs;
  const auto under_base = [&](const std::string& path) { return path.empty() ? fs::path() : base / path; };
  std::vector<std::string> views = text.views;
  for (const std::string& run : text.run)
    for (const std::string& motion : text.motion) {
      const bool moves = motion != own_motion || !text.scene.empty();
      if (text.views.empty()) views = {moves ? "first" : "test"};
      for (const std::string& view : views) {
        BatchJob job{base / run, under_base(text.scene), text.film, text.layers, {}};
        job.film.views = view.ends_with(".json") ? (base / view).string() : view;
        if (motion != own_motion) job.film.motion = base / motion;
        job.film.mapping = under_base(text.motion_names);
        std::string name = stem(view);
        if (motion != own_motion) name += "-" + stem(motion);
        const fs::path folder = base / text.output / (text.name.empty() ? run_name(run) : text.name);
        for (const StyleMixture& style : text.style)
          job.films.push_back(film_of(text, style, folder / name, base));
        jobs.push_back(std::move(job));
      }
    }
  return jobs;
}

}  // namespace

std::vector<BatchJob> load_batch(const fs::path& path) {
  const std::string source = path.string();
  const toml::table file = parse_toml(read_whole_file(path), source);
  JobText defaults;
  apply(defaults, file, "job", source);
  const toml::node* list = file.get("job");
  if (!list || !list->is_array_of_tables()) throw UsageError(fmt::format("{}: it has no [[job]]", source));
  std::vector<BatchJob> jobs;
  std::set<fs::path> names;
  for (const toml::node& node : *list->as_array()) {
    const std::string where = line_of(node, source);
    JobText text = defaults;
    apply(text, *node.as_table(), "", source);
    if (text.run.empty()) throw UsageError(fmt::format("{}: the job has no 'run'", where));
    for (BatchJob& job : multiplied(text, path.parent_path())) {
      for (const BatchFilm& film : job.films)
        if (!names.insert(film.folder.lexically_normal()).second)
          throw UsageError(fmt::format("{}: two films would be {}.mp4: give a job another 'name'", where,
                                       film.folder.string()));
      jobs.push_back(std::move(job));
    }
  }
  return jobs;
}

}  // namespace vivant
