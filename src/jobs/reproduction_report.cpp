// How figures are laid out: tables, curves, JSON.
#include <algorithm>
#include <cmath>
#include <iterator>

#include "jobs/reproduction.hpp"
#include "vivant/io/atomic_file.hpp"

namespace vivant {
namespace {

using nlohmann::ordered_json;
using Number = std::optional<double>;

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

double number_or_nan(const ordered_json& value) { return value.is_number() ? value.get<double>() : NAN; }

/// The notes of all reports: what is a capture's own, under its name, then once what all of them say.
std::vector<std::string> joined_notes(const std::vector<Reproduction>& all) {
  const auto in_all = [&](const std::string& note) {
    return std::ranges::all_of(all, [&](const Reproduction& made) {
      return std::ranges::find(made.report.notes, note) != made.report.notes.end();
    });
  };
  std::vector<std::string> notes;
  for (const Reproduction& made : all)
    for (const std::string& note : made.report.notes)
      if (!in_all(note)) notes.push_back(fmt::format("{}: {}", made.rows.at(0).capture, note));
  std::ranges::copy_if(all[0].report.notes, std::back_inserter(notes), in_all);
  return notes;
}

}  // namespace

std::vector<Report::Table> reproduction_tables(const std::vector<ReproductionRow>& rows,
                                               const std::string& prefix) {
  std::vector<Report::Table> tables;
  std::string last;
  for (const ReproductionRow& row : rows) {
    if (row.table == last) continue;
    last = row.table;
    tables.push_back(laid_out(row.table, rows));
    tables.back().title = prefix + row.table;
  }
  return tables;
}

std::vector<Report::Plot> reproduction_plots(const ReproductionPlan& plan, const StageResults& results) {
  std::vector<Report::Plot> plots;
  for (const std::string& views : plan.views) {
    const ordered_json& measured = results.at(film_stage(views, plan.styles[0]));
    for (std::size_t g = 0; g < measured.value("gaps", ordered_json::array()).size(); ++g) {
      Report::Plot plot{fmt::format("{}, {}: consistency, gap {}", views, plan.styles[0],
                                    measured["gaps"][g]["gap"].get<int>()),
                        "frame",
                        "ST-LPIPS",
                        {}};
      for (const ordered_json& film : measured["films"]) {
        Report::Curve& curve =
            plot.curves.emplace_back(film["film"].get<std::string>(), std::vector<double>{});
        for (const ordered_json& value : film["consistency"][g]["stlpips_by_frame"])
          curve.values.push_back(number_or_nan(value));
      }
      plots.push_back(plot);
    }
  }
  return plots;
}

Reproduction joined(const std::vector<Reproduction>& all, const std::filesystem::path& folder) {
  Reproduction one{{}, {"The paper's tables", {}, {}, {}, {}}, folder};
  for (const Reproduction& made : all) one.rows.insert(one.rows.end(), made.rows.begin(), made.rows.end());
  const std::vector<ReproductionRow> means = mean_rows(one.rows, all.size());
  one.report.notes.push_back(
      fmt::format("{} captures, and the means over them of what all of them have.", all.size()));
  one.report.tables = reproduction_tables(means, "mean: ");
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  append(one.report.notes, joined_notes(all));
  for (const Reproduction& made : all) {
    const std::string name = made.rows.at(0).capture;
    append(one.report.tables, reproduction_tables(made.rows, name + ": "));
    for (const Report::Video& video : made.report.videos)
      one.report.videos.push_back({fmt::format("{}: {}", name, video.name), video.file});
    for (Report::Plot plot : made.report.plots) {
      plot.title = fmt::format("{}: {}", name, plot.title);
      one.report.plots.push_back(plot);
    }
  }
  append(one.rows, means);
  return one;
}

ordered_json Reproduction::json() const {
  ordered_json all = {{"rows", ordered_json::array()}};
  const auto number = [](const std::optional<double>& value) {
    return value ? ordered_json(*value) : ordered_json();
  };
  for (const ReproductionRow& row : rows)
    all["rows"].push_back({{"table", row.table},
                           {"capture", row.capture},
                           {"method", row.method},
                           {"metric", row.metric},
                           {"value", number(row.value)},
                           {"paper", number(row.paper)}});
  return all;
}

void write_reproduction(const Reproduction& made) {
  write_text_file(made.folder / "report.json", made.json().dump(1) + "\n");
  write_text_file(made.folder / "report.md", made.report.markdown());
  write_text_file(made.folder / "report.html", made.report.html());
}

}  // namespace vivant
