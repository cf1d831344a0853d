// The stages of `vivant reproduce`. Each leaves its result in results/NAME.json when it is done.
#include "vivant/jobs/reproduce.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "jobs/content_name.hpp"
#include "jobs/elapsed.hpp"
#include "jobs/reproduction.hpp"
#include "jobs/training_pictures.hpp"
#include "vivant/data/motion.hpp"
#include "vivant/io/assets.hpp"
#include "vivant/io/atomic_file.hpp"
#include "vivant/io/image.hpp"
#include "vivant/io/json.hpp"
#include "vivant/jobs/evaluate.hpp"
#include "vivant/jobs/evaluate_film.hpp"
#include "vivant/jobs/interrupt.hpp"
#include "vivant/jobs/render.hpp"
#include "vivant/jobs/stylise_pictures.hpp"
#include "vivant/jobs/train.hpp"
#include "vivant/model/view_renderer.hpp"

namespace vivant {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr const char* adaattn_form = "cosine";  // its video variant
constexpr int novel_frames = 24;                // of the films that the capture does not give the length of

struct Stage {
  std::string name;
  std::function<ordered_json()> work;  ///< what it gives the report
};

/// Views, and the flow that measures them. The capture's pictures favour no method's geometry.
struct FilmedViews {
  std::string name;
  FilmOptions film;
  FlowKind flow;
};

/// A name as a part of a file's.
std::string dashed(std::string name) {
  std::replace(name.begin(), name.end(), ' ', '-');
  return name;
}

/// The capture's folder, of which `path` may be the transforms.json.
fs::path capture_folder(const fs::path& path) {
  const fs::path full = fs::weakly_canonical(path);
  return fs::is_regular_file(full) ? full.parent_path() : full;
}

/// One capture's part of it.
class Plan {
 public:
  Plan(Device& device, const ReproduceOptions& options, const fs::path& capture, const fs::path& output,
       Progress& progress);

  const fs::path& folder() const { return folder_; }
  const ReproductionPlan& subject() const { return subject_; }
  std::vector<Stage> stages();
  /// Does what is not done yet; the results of all stages.
  StageResults run();
  /// The films of the first style.
  std::vector<Report::Video> videos() const;

 private:
  void check_folder(const ReproduceOptions& options) const;
  fs::path run_folder(const std::string& method) const { return folder_ / "runs" / dashed(method); }
  fs::path film_folder(const std::string& name) const { return folder_ / "films" / dashed(name); }
  Look look(std::size_t style) const { return Look::whole({{styles_[style], 1}}); }

  void add_run(std::vector<Stage>& stages, const std::string& method, const std::string& planes);
  void add_films(std::vector<Stage>& stages, const FilmedViews& views);
  ordered_json train_run(const std::string& method, const std::string& planes);
  ordered_json render_frames(const std::string& method, const FilmedViews& views, const Look& look,
                             const fs::path& output);
  ordered_json captured_frames(const fs::path& output) const;
  ordered_json measure_run_time();

  Device& device_;
  Progress& progress_;
  Config config_;
  Capture capture_;
  std::vector<fs::path> styles_;
  std::vector<FilmedViews> views_;
  fs::path capture_path_, folder_;
  ReproductionPlan subject_;
};

Plan::Plan(Device& device, const ReproduceOptions& options, const fs::path& capture, const fs::path& output,
           Progress& progress)
    : device_(device),
      progress_(progress),
      config_(options.config),
      capture_(load_capture(capture)),
      styles_(options.styles.empty() ? pictures_below(asset_path("styles")) : options.styles),
      capture_path_(capture_folder(capture)),
      folder_(output),
      subject_{capture_path_.filename().string(), config_, {}, {}, camera_only_rotates(capture_)} {
  for (const fs::path& style : styles_) {
    read_image(style);  // a bad one stops the program before hours of work
    const std::string name = style.stem().string();
    if (std::any_of(subject_.styles.begin(), subject_.styles.end(),
                    [&](const std::string& other) { return dashed(other) == dashed(name); }))
      throw UsageError(fmt::format("two styles are called '{}': rename one", name));
    if (dashed(name) == "rendered")
      throw UsageError("a style is called 'rendered', as the unstylised films are: rename it");
    subject_.styles.push_back(name);
  }
  if (styles_.empty()) throw UsageError("the program's own paintings are missing: name one with --style");
  views_ = {{original_views, {.views = "all"}, FlowKind::dis},
            {novel_views, {.views = "orbit", .orbit_frames = novel_frames}, FlowKind::automatic}};
  fs::path motion = options.motion;
  if (motion.empty() && fs::exists(capture_path_ / "dance.safetensors"))
    motion = capture_path_ / "dance.safetensors";
  if (!motion.empty() && capture_.human) {
    const int length = resampled(load_motion(motion, capture_.human->body), capture_.fps).frame_count();
    views_.push_back(
        {novel_poses,
         {.views = "first", .frames = std::pair(0, std::min(length, novel_frames)), .motion = motion},
         FlowKind::automatic});
  } else if (!options.motion.empty()) {
    throw UsageError(
        fmt::format("{} has no person who could be animated: leave --motion out", subject_.capture));
  }
  for (const FilmedViews& views : views_) subject_.views.push_back(views.name);
  check_folder(options);
}

/// Results of other options, or by other weights than those that come with this program, are never mixed with
/// these.
void Plan::check_folder(const ReproduceOptions& options) const {
  ordered_json made_with = {{"capture", capture_path_.string()},
                            {"weights",
                             {content_name(shipped_stylizer(adaattn_form)),
                              content_name(shipped_stylizer(StylisePicturesOptions().form))}},
                            {"motion", options.motion.empty() ? "" : fs::absolute(options.motion).string()}};
  for (const fs::path& style : styles_) made_with["styles"].push_back(fs::absolute(style).string());
  const fs::path file = folder_ / "plan.json";
  if (!fs::exists(file)) {
    make_folder(folder_ / "results");
    made_with["settings"] = to_toml(config_);
    write_text_file(file, made_with.dump(1) + "\n");
    return;
  }
  const nlohmann::json before = read_json(file);
  const auto refuse = [&](const std::string& what) {
    fail("{} was begun with other options ({} differ): give the same ones, or another folder by -o",
         folder_.string(), what);
  };
  if (before.value("weights", nlohmann::json()) != nlohmann::json(made_with["weights"]))
    fail("{} was begun by a program with other weights of its stylizers: choose another folder by -o",
         folder_.string());
  for (const auto& [key, value] : made_with.items())
    if (before.value(key, nlohmann::json()) != nlohmann::json(value)) refuse(key);
  if (!(parse_run_config(before.value("settings", ""), file.string()) == config_)) refuse("settings");
}

ordered_json Plan::train_run(const std::string& method, const std::string& planes) {
  TrainOptions train_options;
  train_options.capture = capture_path_;
  train_options.run = run_folder(method);
  train_options.config = config_;
  train_options.config.scene.planes = train_options.config.human.planes = planes;
  train_options.resume = fs::exists(train_options.run / "config.toml");
  train(device_, train_options, progress_);
  progress_.record_nowhere();
  return ordered_json::object();
}

ordered_json Plan::render_frames(const std::string& method, const FilmedViews& views, const Look& look,
                                 const fs::path& output) {
  RenderOptions options;
  options.run = run_folder(method);
  options.film = views.film;
  options.look = look;
  options.output = output;
  fs::remove_all(output);
  render(device_, options, progress_);
  return ordered_json::object();
}

ordered_json Plan::captured_frames(const fs::path& output) const {
  make_folder(output);
  for (int i = 0; i < static_cast<int>(capture_.frames.size()); ++i)
    write_image(output / fmt::format("{:04}.png", i), capture_.taken_image(i));
  return ordered_json::object();
}

/// The scene's field alone, planes and perceptron, on the same rays and as many samples; nothing is left out.
ordered_json Plan::measure_run_time() {
  constexpr int side = 64, repetitions = 3;
  ordered_json result = {{"rays", side * side}, {"samples", config_.scene.samples}};
  for (const Encoding encoding : {Encoding::vanilla, Encoding::mlp}) {
    ParameterStore store;
    FieldOptions field{.encoding = encoding,
                       .plane_size = config_.scene.plane_size,
                       .channels = config_.scene.plane_channels};
    const SceneModel scene(device_, store, Initializer(1), field, {.near = 0.5, .far = 2},
                           static_cast<int>(config_.scene.samples));
    store.allocate(device_);
    SceneRenderer renderer(device_, scene, {.tile_rays = side * side, .weight_threshold = 0});
    const Camera camera{
        .width = side, .height = side, .fx = side, .fy = side, .cx = side / 2.0, .cy = side / 2.0};
    renderer.render(camera);  // builds programs, touches memory
    double best = INFINITY;
    for (int i = 0; i < repetitions; ++i) {
      const auto start = std::chrono::steady_clock::now();
      renderer.render(camera);
      best = std::min(best, 1000 * seconds_since(start));
    }
    result[encoding == Encoding::mlp ? "mlp_ms" : "planes_ms"] = best;
  }
  return result;
}

void Plan::add_run(std::vector<Stage>& stages, const std::string& method, const std::string& planes) {
  stages.push_back({"train " + method, [=, this] { return train_run(method, planes); }});
  if (!capture_.held_out_frames().empty())
    stages.push_back(
        {"held-out " + method, [=, this] {
           return evaluate(device_, open_run(device_, run_folder(method), progress_), {}, progress_).json();
         }});
}

void Plan::add_films(std::vector<Stage>& stages, const FilmedViews& views) {
  const bool original = views.name == original_views;
  const fs::path rendered = film_folder(views.name + " rendered"), captured = film_folder("captured");
  stages.push_back(
      {"render " + views.name, [=, this] { return render_frames(method_ours, views, {}, rendered); }});
  if (original) stages.push_back({"captured frames", [=, this] { return captured_frames(captured); }});
  for (std::size_t s = 0; s < styles_.size(); ++s) {
    const std::string of_style = views.name + " " + subject_.styles[s];
    FilmEvaluationOptions film;
    film.run = run_folder(method_ours);
    film.film = views.film;
    film.look = look(s);
    film.flow = views.flow;
    film.output = film_folder(of_style);
    const auto paint = [&](const char* method, const fs::path& input) {
      const fs::path output = film_folder(fmt::format("{} {}", of_style, method));
      film.others.push_back({method, output, method == std::string(method_rendered)});
      stages.push_back({fmt::format("{}, {}", of_style, method), [=, this] {
                          StylisePicturesOptions painting;
                          painting.input = input;
                          painting.style = styles_[s];
                          painting.form = adaattn_form;
                          painting.output = output;
                          fs::remove_all(output);
                          stylise_pictures(device_, painting, progress_);
                          return ordered_json::object();
                        }});
    };
    paint(method_rendered, rendered);
    if (original) paint(method_captured, captured);
    const fs::path vanilla = film_folder(of_style + " " + method_vanilla);
    film.others.push_back({method_vanilla, vanilla});
    stages.push_back({of_style + ", " + method_vanilla,
                      [=, this] { return render_frames(method_vanilla, views, look(s), vanilla); }});
    stages.push_back({film_stage(views.name, subject_.styles[s]),
                      [=, this] { return evaluate_film(device_, film, progress_).json(); }});
  }
}

std::vector<Stage> Plan::stages() {
  std::vector<Stage> stages;
  add_run(stages, method_ours, "full");
  add_run(stages, method_vanilla, "vanilla");
  stages.push_back({"run time", [this] { return measure_run_time(); }});
  for (const FilmedViews& views : views_) add_films(stages, views);
  return stages;
}

StageResults Plan::run() {
  const InterruptGuard guard;
  const std::vector<Stage> all = stages();
  StageResults results;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const fs::path file = folder_ / "results" / (dashed(all[i].name) + ".json");
    if (!fs::exists(file)) {
      progress_.info(fmt::format("{} of {}: {}", i + 1, all.size(), all[i].name));
      try {
        write_text_file(file, all[i].work().dump(1) + "\n");
        if (interrupted()) throw Interrupted("");
      } catch (const Interrupted&) {
        throw Interrupted(
            fmt::format("stopped in stage {} of {}; the same command goes on from here", i + 1, all.size()));
      }
    }
    results[all[i].name] = ordered_json::parse(read_whole_file(file));
  }
  return results;
}

std::vector<Report::Video> Plan::videos() const {
  std::vector<Report::Video> videos;
  for (const FilmedViews& views : views_) {
    const fs::path folder = film_folder(views.name + " " + subject_.styles[0]);
    for (const char* film :
         {"capture", "unstylised", method_ours, method_captured, method_rendered, method_vanilla})
      if (const fs::path file = folder / (std::string(film) + ".mp4"); fs::exists(file))
        videos.push_back({fmt::format("{}: {}", views.name, film), file});
  }
  return videos;
}

Reproduction made_by(Plan& plan) {
  const StageResults results = plan.run();
  const ReproductionPlan& subject = plan.subject();
  Reproduction made{reproduction_rows(subject, results), {}, plan.folder()};
  made.report = {"The paper's tables: " + subject.capture, reproduction_notes(subject, results, made.rows),
                 reproduction_tables(made.rows), reproduction_plots(subject, results), plan.videos()};
  write_reproduction(made);
  return made;
}

}  // namespace

std::string film_stage(const std::string& views, const std::string& style) {
  return fmt::format("measure {} {}", views, style);
}

Reproduction reproduce(Device& device, const ReproduceOptions& options, Progress& progress) {
  std::vector<std::string> names;
  for (const fs::path& capture : options.captures) {
    names.push_back(capture_folder(capture).filename().string());
    if (std::count(names.begin(), names.end(), names.back()) > 1)
      throw UsageError(fmt::format("two captures are called '{}': rename one", names.back()));
  }
  const bool alone = names.size() == 1;
  const fs::path standard = alone ? names[0] + "-report" : "reproduction",
                 output = options.output.empty() ? standard : options.output;
  // All plans first: a bad capture stops the program before hours of work.
  std::vector<std::unique_ptr<Plan>> plans;
  for (std::size_t i = 0; i < names.size(); ++i)
    plans.push_back(std::make_unique<Plan>(device, options, options.captures[i],
                                           alone ? output : output / names[i], progress));
  std::vector<Reproduction> all;
  all.reserve(plans.size());
  for (const auto& plan : plans) all.push_back(made_by(*plan));
  if (alone) return all[0];
  const Reproduction one = joined(all, output);
  write_reproduction(one);
  return one;
}

}  // namespace vivant
