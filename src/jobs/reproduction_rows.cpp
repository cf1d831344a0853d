// The paper's tables with our figures beside its own.
#include <algorithm>
#include <array>
#include <span>

#include "jobs/reproduction.hpp"

namespace vivant {
namespace {

using nlohmann::ordered_json;
using Number = std::optional<double>;

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
  // The paper measures vanilla planes in its ablation alone.
  for (ConsistencyTable& table : tables)
    table.lines.insert(table.lines.begin() + 1, {method_vanilla, method_vanilla, {}});
  tables.push_back({"2D methods on our rendered frames",
                    {original_views},
                    {{"vivant", method_ours, mean_of_data_sets(0.165, 0.214)},
                     {method_rendered, method_rendered, mean_of_data_sets(0.179, 0.267)},
                     {"LST", "", mean_of_data_sets(0.185, 0.248)},
                     {"CCPL", "", mean_of_data_sets(0.261, 0.321)}}});
  tables.push_back({vanilla_table,
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
          {"style distance: Gram", number_in(style, "gram")},
          {"content distance", number_in(style, "content")}};
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

class Rows {
 public:
  explicit Rows(const std::string& capture) : capture_(capture) {}

  void add(const std::string& table, const std::string& method, const std::string& metric, Number value,
           Number paper = {}) {
    rows_.push_back({table, capture_, method, metric, value, paper});
  }
  void add_run_time(const ordered_json& measured);
  void add_held_out(const StageResults& results);
  std::vector<ReproductionRow> take() { return std::move(rows_); }

 private:
  std::string capture_;
  std::vector<ReproductionRow> rows_;
};

void Rows::add_run_time(const ordered_json& measured) {
  const std::string metric =
      fmt::format("ms for {} rays x {} samples", measured["rays"].get<int>(), measured["samples"].get<int>());
  const double planes = measured["planes_ms"], mlp = measured["mlp_ms"];
  add("run time", "tri-plane", metric, planes);
  add("run time", "MLP field (8 layers of 256)", metric, mlp);
  add("run time", "tri-plane against MLP field", "time saved, %", 100 * (1 - planes / mlp), 70);
}

void Rows::add_held_out(const StageResults& results) {
  for (const char* method : {method_ours, method_vanilla})
    if (const auto found = results.find(std::string("held-out ") + method); found != results.end())
      for (const auto& [key, metric] : {std::pair("psnr", held_out_psnr),
                                        {"ssim", "SSIM"},
                                        {"stlpips", "ST-LPIPS"},
                                        {"person_psnr", "person's PSNR, dB"},
                                        {"person_stlpips", "person's ST-LPIPS"},
                                        {"background_psnr", "background's PSNR, dB"},
                                        {"background_stlpips", "background's ST-LPIPS"},
                                        {"silhouette_iou", "silhouette's IoU"}})
        if (const Number value = number_in(found->second, key)) add(held_out_table, method, metric, value);
}

}  // namespace

std::vector<ReproductionRow> reproduction_rows(const ReproductionPlan& plan, const StageResults& results) {
  Rows rows(plan.capture);
  for (const ConsistencyTable& table : consistency_tables(plan))
    for (const Line& line : table.lines)
      for (const auto& [metric, value] : mean_figures(plan, results, table.views, line.film))
        if (metric == both_gaps || !line.film.empty())
          rows.add(table.title, line.method, metric, value, metric == both_gaps ? line.paper : std::nullopt);
  rows.add_run_time(results.at("run time"));
  rows.add_held_out(results);
  return rows.take();
}

std::vector<ReproductionRow> mean_rows(const std::vector<ReproductionRow>& rows, std::size_t captures) {
  std::vector<ReproductionRow> means;
  for (const ReproductionRow& first : rows) {
    const auto same = [&](const ReproductionRow& row) {
      return row.table == first.table && row.method == first.method && row.metric == first.metric;
    };
    if (std::any_of(means.begin(), means.end(), same)) continue;
    std::vector<Number> values;
    for (const ReproductionRow& row : rows)
      if (same(row)) values.push_back(row.value);
    if (values.size() < captures) continue;
    means.push_back({first.table, "mean", first.method, first.metric, mean_of(values), first.paper});
  }
  return means;
}

}  // namespace vivant
