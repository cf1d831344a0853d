// The paper's tables with our figures beside its own.
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <sstream>

#include "jobs/reproduction.hpp"

namespace vivant {
namespace {

using nlohmann::ordered_json;
using Number = std::optional<double>;

constexpr const char* both_gaps = "ST-LPIPS, mean of gaps 1 and 7";  // what the paper's LPIPS is the mean of

/// A row of a table: a film of ours, none for what is not run here, and the paper's LPIPS.
struct Line {
  std::string method, film;
  Number paper;
};

struct ConsistencyTable {
  std::string title;
  std::vector<std::string> views;  ///< whose mean it shows
  std::vector<Line> lines;
};

/// The paper's two data sets, its own and NeuMan, have the same weight.
Number mean_of_data_sets(double own, double neuman) { return (own + neuman) / 2; }

std::vector<ConsistencyTable> consistency_tables(const ReproductionPlan& plan) {
  std::vector<std::string> novel;
  for (const std::string& views : plan.views)
    if (views != original_views) novel.push_back(views);
  const std::vector<Line> references = {{"unstylised", "unstylised", {}}, {"captured frames", "capture", {}}};
  std::vector<ConsistencyTable> tables = {
      {"original views",
       {original_views},
       {{"vivant", method_ours, mean_of_data_sets(0.165, 0.214)},
        {method_captured, method_captured, mean_of_data_sets(0.161, 0.239)},
        {"LST", "", mean_of_data_sets(0.169, 0.226)},
        {"CCPL", "", mean_of_data_sets(0.231, 0.298)},
        {"StyleRF", "", mean_of_data_sets(0.293, 0.387)}}},
      {"novel views and poses",
       novel,
       {{"vivant", method_ours, 0.143},
        {method_rendered, method_rendered, 0.152},
        {"LST", "", 0.159},
        {"IEContraAST", "", 0.269},
        {"CSBNet", "", 0.247},
        {"CCPL", "", 0.239}}}};
  for (const std::string& views : novel)
    tables.push_back({views, {views}, {{"vivant", method_ours, {}}, {method_rendered, method_rendered, {}}}});
  tables.push_back({"2D methods on our rendered frames",
                    {original_views},
                    {{"vivant", method_ours, mean_of_data_sets(0.165, 0.214)},
                     {method_rendered, method_rendered, mean_of_data_sets(0.179, 0.267)},
                     {"LST", "", mean_of_data_sets(0.185, 0.248)},
                     {"CCPL", "", mean_of_data_sets(0.261, 0.321)}}});
  tables.push_back({"vanilla tri-plane",
                    {original_views},
                    {{"vivant", method_ours, 0.182}, {method_vanilla, method_vanilla, 0.207}}});
  // What the mean over frames does, to our films and to AdaAttN's; both films of the last table have it.
  for (ConsistencyTable& table : std::span(tables).first(tables.size() - 1)) {
    table.lines.insert(table.lines.begin() + 1, {method_unaveraged, method_unaveraged, {}});
    const auto rendered = std::find_if(table.lines.begin(), table.lines.end(),
                                       [](const Line& line) { return line.film == method_rendered; });
    if (rendered != table.lines.end())
      table.lines.insert(rendered + 1, {method_rendered_averaged, method_rendered_averaged, {}});
  }
  for (ConsistencyTable& table : tables)
    for (const Line& line : references)
      if (line.film == "unstylised" || table.views == std::vector<std::string>{original_views})
        table.lines.push_back(line);
  return tables;
}

Number number_in(const ordered_json& json, const std::string& key) {
  return json.contains(key) && json[key].is_number() ? Number(json[key].get<double>()) : std::nullopt;
}

Number mean_of(const std::vector<Number>& numbers) {
  double sum = 0;
  for (const Number& number : numbers) {
    if (!number) return std::nullopt;
    sum += *number;
  }
  return numbers.empty() ? std::nullopt : Number(sum / static_cast<double>(numbers.size()));
}

/// A film's figures by metric; without a film's measurement all are absent.
std::vector<std::pair<std::string, Number>> figures_of(const ordered_json& film) {
  std::array<Number, 4> gaps;
  for (const ordered_json& gap : film.value("consistency", ordered_json::array())) {
    const std::size_t at = gap["gap"] == 1 ? 0 : 2;
    gaps[at] = number_in(gap, "stlpips");
    gaps[at + 1] = number_in(gap, "rmse");
  }
  const ordered_json style = film.value("style", ordered_json::object());
  return {{both_gaps, mean_of({gaps[0], gaps[2]})},
          {"ST-LPIPS gap 1", gaps[0]},
          {"RMSE gap 1", gaps[1]},
          {"ST-LPIPS gap 7", gaps[2]},
          {"RMSE gap 7", gaps[3]},
          {"style distance: mean, dev.", number_in(style, "statistics")},
          {"style distance: Gram", number_in(style, "gram")}};
}

ordered_json film_in(const ordered_json& measured, const std::string& name) {
  for (const ordered_json& film : measured.at("films"))
    if (film["film"] == name) return film;
  return ordered_json::object();
}

/// The same, as the mean over styles and views.
std::vector<std::pair<std::string, Number>> mean_figures(const ReproductionPlan& plan,
                                                         const StageResults& results,
                                                         const std::vector<std::string>& views,
                                                         const std::string& film) {
  std::vector<std::pair<std::string, Number>> figures = figures_of(ordered_json::object());
  if (film.empty()) return figures;
  std::vector<std::vector<Number>> all(figures.size());
  for (const std::string& view : views)
    for (const std::string& style : plan.styles) {
      const auto own = figures_of(film_in(results.at(film_stage(view, style)), film));
      for (std::size_t i = 0; i < own.size(); ++i) all[i].push_back(own[i].second);
    }
  for (std::size_t i = 0; i < figures.size(); ++i) figures[i].second = mean_of(all[i]);
  return figures;
}

void add_run_time(std::vector<ReproductionRow>& rows, const ordered_json& measured) {
  const std::string metric =
      fmt::format("ms for {} rays x {} samples", measured["rays"].get<int>(), measured["samples"].get<int>());
  const double planes = measured["planes_ms"], mlp = measured["mlp_ms"];
  rows.push_back({"run time", "tri-plane", metric, planes, {}});
  rows.push_back({"run time", "MLP field (8 layers of 256)", metric, mlp, {}});
  rows.push_back({"run time", "tri-plane against MLP field", "time saved, %", 100 * (1 - planes / mlp), 70});
}

void add_held_out(std::vector<ReproductionRow>& rows, const StageResults& results) {
  for (const char* method : {method_ours, method_vanilla})
    if (const auto found = results.find(std::string("held-out ") + method); found != results.end())
      for (const auto& [key, metric] : {std::pair("psnr", "PSNR, dB"),
                                        {"person_psnr", "person's PSNR, dB"},
                                        {"stlpips", "ST-LPIPS"},
                                        {"silhouette_iou", "silhouette's IoU"}})
        if (const Number value = number_in(found->second, key))
          rows.push_back({"held-out frames", method, metric, value, {}});
}

std::string cell_of(const Number& number) {
  return number ? cell(*number, std::abs(*number) < 10 ? 4 : 1) : "-";
}

/// The rows of a table, a line for each method and a column for each metric.
Report::Table laid_out(const std::string& title, const std::vector<ReproductionRow>& rows) {
  Report::Table table{title, {"method"}, {}};
  std::vector<std::string> metrics;
  for (const ReproductionRow& row : rows) {
    if (row.table != title || std::count(metrics.begin(), metrics.end(), row.metric) > 0) continue;
    metrics.push_back(row.metric);
    table.header.push_back(row.metric);
    if (std::any_of(rows.begin(), rows.end(), [&](const ReproductionRow& other) {
          return other.table == title && other.metric == row.metric && other.paper;
        }))
      table.header.push_back(row.metric == both_gaps ? "paper: LPIPS" : "paper");
  }
  for (const ReproductionRow& first : rows) {
    const bool known = std::any_of(table.rows.begin(), table.rows.end(),
                                   [&](const auto& line) { return line[0] == first.method; });
    if (first.table != title || known) continue;
    std::vector<std::string>& line = table.rows.emplace_back(std::vector<std::string>{first.method});
    std::size_t column = 1;
    for (const std::string& metric : metrics) {
      const auto row = std::find_if(rows.begin(), rows.end(), [&](const ReproductionRow& other) {
        return other.table == title && other.method == first.method && other.metric == metric;
      });
      line.push_back(row == rows.end() ? "-" : cell_of(row->value));
      if (++column < table.header.size() && table.header[column].starts_with("paper")) {
        line.push_back(row == rows.end() ? "-" : cell_of(row->paper));
        ++column;
      }
    }
  }
  return table;
}

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

/// What must be known to read the figures beside the paper's.
std::vector<std::string> differences(const ReproductionPlan& plan, const StageResults& results) {
  std::string styles, flows;
  for (const std::string& style : plan.styles) styles += (styles.empty() ? "" : ", ") + style;
  for (const std::string& views : plan.views)
    flows += fmt::format("{}{}: {}", flows.empty() ? "" : "; ", views,
                         results.at(film_stage(views, plan.styles[0]))["flow"].get<std::string>());
  std::vector<std::string> notes;
  const auto add = [&](const std::string& note) { notes.push_back(note); };
  const std::string changed = changed_settings(plan.config);
  add(fmt::format(
      "The paper's tables on one capture, {}, with the preset {}{}: {} steps for the scene, {} for "
      "the person, {} for "
      "features, {} for stylisation. Styles: {}. Figures are means over them. A dash stands for "
      "what was not run or "
      "not measured (too few frames, too little visible in both).",
      plan.capture, plan.config.preset, changed.empty() ? "" : fmt::format(" ({})", changed),
      plan.config.scene.steps, plan.config.human.steps, plan.config.features.steps, plan.config.style.steps,
      styles));
  add("What differs from the paper, so that only the order and the ratios of methods can be compared, not "
      "the "
      "numbers:");
  add("Captures. The paper has six NeuMan videos and two of its own; where it gives a figure for each data "
      "set the "
      "mean of the two stands here. It does not name its paintings.");
  add("Metric. The paper warps by optical flow and takes masked LPIPS, the mean of adjacent and far-away "
      "views, "
      "without saying how far. Here it is masked ST-LPIPS (the shift-tolerant metric, not LPIPS), frame t "
      "against "
      "frame t + 1 and t + 7. The unstylised film is the most consistent one by nature; figures count beside "
      "its "
      "own, and beside the style distances: a film that is painted less flickers less.");
  add(fmt::format(
      "Optical flow ({}). Of the original views it comes from the captured pictures, so that no method is "
      "measured by its own geometry.",
      flows));
  add("AdaAttN is the network of its video variant, frame by frame (`vivant stylise --form cosine`): "
      "VGG-19's relu3_1 of each picture, no scene. Its weights are this program's (assets/README.md), not "
      "the authors'. AdaAttN also takes relu4_1 and relu5_1. LST, CCPL, IEContraAST, CSBNet and StyleRF are "
      "not run; their rows hold the paper's figures alone.");
  add("Our films are means over seven frames along the flow (vivant-unaveraged: without it); the paper's and "
      "AdaAttN's are not. AdaAttN on rendered frames-averaged is its film after the same mean. Our films "
      "also have the painting's brushwork laid onto the surfaces, which the paper has not.");
  add("Vanilla tri-plane: planes of scene and person optimised directly, all other settings and steps the "
      "same. Its "
      "film is measured by the same flow.");
  add("Run time: the scene's field without the person, forward, from planes that are ready, against the "
      "original "
      "NeRF's perceptron on equal rays and samples; neither is trained, which does not change the work. The "
      "paper's "
      "\"speedup of approximately 70 %\" is read as time saved; read as 1.7 times as fast it would be 41 %.");
  if (plan.shell)
    add("The camera of this capture only rotates: the scene is a far shell, whose planes are always "
        "optimised "
        "directly. Geometry-guided and vanilla differ in the person alone.");
  if (std::count(plan.views.begin(), plan.views.end(), novel_poses) == 0)
    notes.push_back(
        "There was no motion (--motion): novel poses are left out, novel views alone stand for both.");
  return notes;
}

}  // namespace

std::vector<ReproductionRow> reproduction_rows(const ReproductionPlan& plan, const StageResults& results) {
  std::vector<ReproductionRow> rows;
  for (const ConsistencyTable& table : consistency_tables(plan))
    for (const Line& line : table.lines)
      for (const auto& [metric, value] : mean_figures(plan, results, table.views, line.film))
        if (metric == both_gaps || !line.film.empty())
          rows.push_back(
              {table.title, line.method, metric, value, metric == both_gaps ? line.paper : std::nullopt});
  add_run_time(rows, results.at("run time"));
  add_held_out(rows, results);
  return rows;
}

Report reproduction_report(const ReproductionPlan& plan, const StageResults& results,
                           const std::vector<ReproductionRow>& rows) {
  Report report{"The paper's tables: " + plan.capture, differences(plan, results), {}, {}, {}};
  for (const ReproductionRow& row : rows)
    if (report.tables.empty() || report.tables.back().title != row.table)
      report.tables.push_back(laid_out(row.table, rows));
  return report;
}

}  // namespace vivant
