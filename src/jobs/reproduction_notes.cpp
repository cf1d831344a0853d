// What a reader of the paper's tables must know.
#include <algorithm>
#include <cmath>
#include <sstream>

#include "jobs/reproduction.hpp"

namespace vivant {
namespace {

/// The settings that are not the preset's: "scene.steps = 500, ...".
std::string changed_settings(const Config& config) {
  std::istringstream ours(to_toml(config)), usual(to_toml(preset_config(config.preset)));
  std::string section, changed;
  for (std::string line, before; std::getline(ours, line) && std::getline(usual, before);) {
    if (line.starts_with("[")) section = line.substr(1, line.find(']') - 1);
    if (line != before)
      changed +=
          fmt::format("{}{}.{}", changed.empty() ? "" : ", ", section, line.substr(0, line.find("  #")));
  }
  return changed;
}

double value_of(const std::vector<ReproductionRow>& rows, const std::string& table, const std::string& method,
                const std::string& metric) {
  for (const ReproductionRow& row : rows)
    if (row.table == table && row.method == method && row.metric == metric) return row.value.value_or(NAN);
  return NAN;
}

/// Whether guided planes are steadier, and what the held-out frames say of the reason.
std::string guided_or_vanilla(const ReproductionPlan& plan, const std::vector<ReproductionRow>& rows) {
  constexpr double papers = 0.182 / 0.207, alike = 0.5;  // dB
  std::string note = "Vanilla tri-plane: planes of scene and person optimised directly";
  note += plan.config.scene.planes == "vanilla"
              ? ", as the preset does: its row is what `vivant train` makes. "
              : ". ";
  note += "All other settings and steps are the same; its films are measured by the same flow.";
  const double guided = value_of(rows, held_out_table, method_ours, held_out_psnr),
               vanilla = value_of(rows, held_out_table, method_vanilla, held_out_psnr),
               ratio = value_of(rows, vanilla_table, method_ours, both_gaps) /
                       value_of(rows, vanilla_table, method_vanilla, both_gaps);
  if (!std::isnan(guided) && !std::isnan(vanilla))
    note +=
        fmt::format(" Held-out frames: {:.1f} dB with geometry-guided planes, {:.1f} dB with vanilla ones.",
                    guided, vanilla);
  if (std::isnan(ratio)) return note;
  note += fmt::format(" The flicker of geometry-guided planes is {:.2f} of theirs ({}; the paper: {:.2f}).",
                      ratio, both_gaps, papers);
  if (ratio > papers && guided < vanilla - alike)
    note += " After so few steps planes from U-Nets are behind, which the rendered films show.";
  else if (ratio > papers && guided < vanilla + alike)
    note += " Both reconstruct about as well, so that there is no better geometry to be steadier by.";
  return note;
}

void add_about_figures(std::vector<std::string>& notes, const ReproductionPlan& plan,
                       const StageResults& results) {
  std::string styles, flows;
  for (const std::string& style : plan.styles) styles += (styles.empty() ? "" : ", ") + style;
  for (const std::string& views : plan.views)
    flows += fmt::format("{}{}: {}", flows.empty() ? "" : "; ", views,
                         results.at(film_stage(views, plan.styles[0]))["flow"].get<std::string>());
  const std::string changed = changed_settings(plan.config);
  notes.push_back(fmt::format(
      "The paper's tables on one capture, {}, with the preset {}{}: {} steps for the scene, {} for the "
      "person, {} for features, {} for stylisation. Styles: {}. Figures are means over them. A dash stands "
      "for what was not run or not measured (too few frames, too little visible in both).",
      plan.capture, plan.config.preset, changed.empty() ? "" : fmt::format(" ({})", changed),
      plan.config.scene.steps, plan.config.human.steps, plan.config.features.steps, plan.config.style.steps,
      styles));
  notes.emplace_back(
      "What differs from the paper, so that only the order and the ratios of methods can be compared, not "
      "the numbers:");
  notes.emplace_back(
      "Captures. The paper has six NeuMan videos and two of its own; where it gives a figure for each data "
      "set the mean of the two stands here. It does not name its paintings.");
  notes.emplace_back(
      "Metric. The paper warps by optical flow and takes masked LPIPS, the mean of adjacent and far-away "
      "views, without saying how far. Here it is masked ST-LPIPS (the shift-tolerant metric, not LPIPS), "
      "frame t against frame t + 1 and t + 7. Read it beside the unstylised film's, which is what the fields "
      "themselves change by, and beside the style distances: a film that is painted less flickers less.");
  notes.push_back(fmt::format(
      "Optical flow ({}). Of the original views it comes from the captured pictures, so that no method is "
      "measured by its own geometry.",
      flows));
}

void add_about_methods(std::vector<std::string>& notes, const ReproductionPlan& plan,
                       const std::vector<ReproductionRow>& rows) {
  notes.emplace_back(
      "AdaAttN is the network of its video variant, frame by frame (`vivant stylise --form cosine`): "
      "VGG-19's relu3_1 of each picture, no scene. Its weights are this program's (assets/README.md), not "
      "the authors'. AdaAttN also takes relu4_1 and relu5_1. LST, CCPL, IEContraAST, CSBNet and StyleRF are "
      "not run; their rows hold the paper's figures alone.");
  notes.emplace_back(
      "Our films are means over seven frames along the flow (vivant-unaveraged: without it); the paper's and "
      "AdaAttN's are not. AdaAttN on rendered frames-averaged is its film after the same mean. Our films "
      "also have the painting's brushwork laid onto the surfaces, which the paper has not.");
  notes.push_back(guided_or_vanilla(plan, rows));
  notes.emplace_back(
      "Run time: the scene's field without the person, forward, from planes that are ready, against the "
      "original NeRF's perceptron on equal rays and samples; neither is trained, which does not change the "
      "work. The paper's \"speedup of approximately 70 %\" is read as time saved; read as 1.7 times as fast "
      "it would be 41 %.");
  if (plan.shell)
    notes.emplace_back(
        "The camera of this capture only rotates: the scene is a far shell, whose planes are always "
        "optimised directly. Geometry-guided and vanilla differ in the person alone.");
  if (std::count(plan.views.begin(), plan.views.end(), novel_poses) == 0)
    notes.emplace_back(
        "There was no motion (--motion): novel poses are left out, novel views alone stand for both.");
}

}  // namespace

std::vector<std::string> reproduction_notes(const ReproductionPlan& plan, const StageResults& results,
                                            const std::vector<ReproductionRow>& rows) {
  std::vector<std::string> notes;
  add_about_figures(notes, plan, results);
  add_about_methods(notes, plan, rows);
  return notes;
}

}  // namespace vivant
