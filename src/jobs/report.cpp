#include "vivant/jobs/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "vivant/io/atomic_file.hpp"

namespace vivant {
namespace {

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '&')
      result += "&amp;";
    else if (c == '"')
      result += "&quot;";
    else
      result += c;
  }
  return result;
}

std::string base64(const std::string& bytes) {
  constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string result;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      result += i + k > bytes.size() ? '=' : digits[group >> (18 - 6 * k) & 63];
  }
  return result;
}

constexpr std::array<const char*, 8> colours = {"#1f77b4", "#d62728", "#2ca02c", "#9467bd",
                                                "#ff7f0e", "#17becf", "#8c564b", "#7f7f7f"};

/// Where a plot's values lie on the page.
struct Axes {
  static constexpr double width = 640, height = 220, left = 64, right = 14, top = 10, bottom = 34;
  double low = 0, high = 1, count = 1;

  explicit Axes(const std::vector<Report::Curve>& curves) {
    low = INFINITY, high = -INFINITY;
    for (const Report::Curve& curve : curves) {
      count = std::max(count, static_cast<double>(curve.values.size()) - 1);
      for (const double value : curve.values)
        if (std::isfinite(value)) low = std::min(low, value), high = std::max(high, value);
    }
    if (!(low <= high)) low = 0, high = 1;
    const double size = std::max(std::abs(low), std::abs(high));
    const double margin = high - low > 1e-9 * size ? 0.05 * (high - low) : std::max(0.01, 0.05 * size);
    low -= margin, high += margin;
  }
  double x(double i) const { return left + i / count * (width - left - right); }
  double y(double value) const { return top + (high - value) / (high - low) * (height - top - bottom); }
};

/// Two to six round numbers from low to high: multiples of 1, 2 or 5 times a power of ten, at least
/// `least`.
std::vector<double> ticks(double low, double high, double least) {
  const double wanted = std::max((high - low) / 5, least),
               power = std::pow(10, std::floor(std::log10(wanted)));
  double step = power;
  for (const double factor : {2.0, 5.0, 10.0})
    if (step < wanted) step = factor * power;
  const double first = std::ceil(low / step);
  const auto count = static_cast<std::size_t>(std::floor(high / step) - first) + 1;
  std::vector<double> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = (first + static_cast<double>(i)) * step + 0.0;  // no -0
  return values;
}

/// The line of a curve, broken where there is no value; a point alone is a dot.
std::string line(const Axes& axes, const std::vector<double>& values, const char* colour) {
  std::string svg;
  for (std::size_t i = 0; i < values.size();) {
    std::string points;
    std::size_t end = i;
    for (; end < values.size() && std::isfinite(values[end]); ++end)
      points += fmt::format("{:.1f},{:.1f} ", axes.x(static_cast<double>(end)), axes.y(values[end]));
    if (end == i + 1)
      svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2\" fill=\"{}\"/>",
                         axes.x(static_cast<double>(i)), axes.y(values[i]), colour);
    else if (end > i)
      svg += fmt::format("<polyline fill=\"none\" stroke=\"{}\" points=\"{}\"/>", colour, points);
    i = std::max(end, i + 1);
  }
  return svg;
}

std::string svg_of(const Report::Plot& plot) {
  const Axes axes(plot.curves);
  std::string svg = fmt::format("<svg viewBox=\"0 0 {} {}\" width=\"{}\" height=\"{}\">\n", Axes::width,
                                Axes::height, Axes::width, Axes::height);
  for (const double value : ticks(axes.low, axes.high, 0)) {
    const double at = axes.y(value);
    svg += fmt::format(
        "<line x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\" stroke=\"#ddd\"/><text x=\"{3}\" "
        "y=\"{4:.1f}\" text-anchor=\"end\">{5:.10g}</text>\n",
        Axes::left, Axes::width - Axes::right, at, Axes::left - 4, at + 4, value);
  }
  for (const double frame : ticks(0, axes.count, 1))
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{:.0f}</text>\n", axes.x(frame),
                       Axes::height - Axes::bottom + 16, frame);
  svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n", Axes::width / 2,
                     Axes::height - 4, escaped(plot.x));
  for (std::size_t i = 0; i < plot.curves.size(); ++i)
    svg += line(axes, plot.curves[i].values, colours[i % colours.size()]) + "\n";
  return svg + "</svg>";
}

std::string html_of(const Report::Table& table) {
  std::string html = fmt::format("<h2>{}</h2>\n<table><tr>", escaped(table.title));
  for (const std::string& title : table.header) html += "<th>" + escaped(title) + "</th>";
  for (const std::vector<std::string>& row : table.rows) {
    html += "</tr>\n<tr>";
    for (const std::string& text : row) html += "<td>" + escaped(text) + "</td>";
  }
  return html + "</tr></table>\n";
}

std::string html_of(const Report::Plot& plot) {
  std::string html = fmt::format("<figure><figcaption><b>{}</b> ({})", escaped(plot.title), escaped(plot.y));
  for (std::size_t i = 0; i < plot.curves.size(); ++i)
    html += fmt::format(" <span style=\"color:{}\">&#9632; {}</span>", colours[i % colours.size()],
                        escaped(plot.curves[i].name));
  return html + "</figcaption>\n" + svg_of(plot) + "</figure>\n";
}

constexpr const char* page_start = R"(<!doctype html>
<html lang="en"><meta charset="utf-8"><title>{0}</title>
<style>
body {{ font: 15px/1.5 sans-serif; margin: 2em auto; max-width: 1400px; padding: 0 1em }}
table {{ border-collapse: collapse }} th, td {{ border: 1px solid #ccc; padding: 2px 8px; text-align: right }}
th:first-child, td:first-child {{ text-align: left }}
.films {{ display: flex; flex-wrap: wrap; gap: 8px }} .films figure {{ margin: 0 }} video {{ max-width: 440px }}
figure {{ display: inline-block; margin: 8px 16px 8px 0; vertical-align: top }} svg {{ font: 11px sans-serif }}
</style>
<h1>{0}</h1>
)";

}  // namespace

std::string cell(double number, int digits) {
  return std::isfinite(number) ? fmt::format("{:.{}f}", number, digits) : "-";
}

std::string Report::text() const {
  std::string result;
  for (const Table& table : tables) {
    std::vector<std::size_t> widths;
    widths.reserve(table.header.size());
    for (const std::string& title : table.header) widths.push_back(title.size());
    for (const std::vector<std::string>& row : table.rows)
      for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
    const auto add = [&](const std::vector<std::string>& row) {
      for (std::size_t i = 0; i < row.size(); ++i)
        result +=
            i == 0 ? fmt::format("{:<{}}", row[i], widths[i]) : fmt::format("  {:>{}}", row[i], widths[i]);
      result += "\n";
    };
    if (tables.size() > 1) result += table.title + "\n";
    add(table.header);
    for (const std::vector<std::string>& row : table.rows) add(row);
    if (&table != &tables.back()) result += "\n";
  }
  return result;
}

std::string Report::markdown() const {
  std::string result = "# " + title + "\n";
  for (const std::string& note : notes) result += "\n" + note + "\n";
  for (const Table& table : tables) {
    result += "\n## " + table.title + "\n\n|";
    for (const std::string& name : table.header) result += " " + name + " |";
    result += "\n|";
    for (std::size_t i = 0; i < table.header.size(); ++i) result += "---|";
    for (const std::vector<std::string>& row : table.rows) {
      result += "\n|";
      for (const std::string& text : row) result += " " + text + " |";
    }
    result += "\n";
  }
  return result;
}

std::string Report::html() const {
  std::string page = fmt::format(page_start, escaped(title));
  for (const std::string& note : notes) page += "<p>" + escaped(note) + "</p>\n";
  page += "<div class=\"films\">\n";
  for (const Video& video : videos)
    page += fmt::format(
        "<figure><video autoplay loop muted controls src=\"data:video/mp4;base64,{}\"></video>"
        "<figcaption>{}</figcaption></figure>\n",
        base64(read_whole_file(video.file)), escaped(video.name));
  page += "</div>\n";
  for (const Table& table : tables) page += html_of(table);
  for (const Plot& plot : plots) page += html_of(plot);
  return page + "</html>\n";
}

void write_report(const std::filesystem::path& folder, const Report& report,
                  const nlohmann::ordered_json& data) {
  make_folder(folder);
  write_text_file(folder / "report.json", data.dump(1) + "\n");
  write_text_file(folder / "report.md", report.markdown());
  write_text_file(folder / "index.html", report.html());
}

}  // namespace vivant
