#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace vivant {

/// Results to be read: tables, curves and videos.
struct Report {
  struct Table {
    std::string title;
    std::vector<std::string> header;
    std::vector<std::vector<std::string>> rows;
  };
  struct Curve {
    std::string name;
    std::vector<double> values;  ///< by x = 0, 1, ...; NaN: none
  };
  struct Plot {
    std::string title, x, y;
    std::vector<Curve> curves;
  };
  struct Video {
    std::string name;
    std::filesystem::path file;  ///< .mp4
  };

  std::string title;
  std::vector<std::string> notes;  ///< a paragraph each
  std::vector<Table> tables;
  std::vector<Plot> plots;
  std::vector<Video> videos;

  /// Tables with aligned columns, for a terminal.
  std::string text() const;
  /// Title, notes and tables.
  std::string markdown() const;
  /// One page that needs no other file: videos side by side, tables, plots as inline SVG.
  std::string html() const;
};

/// Writes report.json (`data`), report.md and index.html into a folder, which is made.
void write_report(const std::filesystem::path& folder, const Report& report,
                  const nlohmann::ordered_json& data);

/// A number as tables show it, "-" for NaN.
std::string cell(double number, int digits);

}  // namespace vivant
