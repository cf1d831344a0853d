#include "bench/ops/roofline_svg.hpp"

#include <cmath>
#include <numbers>

#include "bench/ops/label_placer.hpp"

namespace vivant::bench {
namespace {

constexpr double legend_row = 14, mark_size = 3.6;
constexpr const char* forward_colour = "#1769aa";
constexpr const char* both_colour = "#c2410c";
constexpr const char* roof_colour = "#111827";

std::string escaped(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    if (c == '&')
      safe += "&amp;";
    else if (c == '<')
      safe += "&lt;";
    else
      safe += c;
  }
  return safe;
}

/// A range that holds all values and a margin, over pixels `from` to `to`.
class LogAxis {
 public:
  LogAxis(const std::vector<double>& values, double from, double to) : from_(from), to_(to) {
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    low_ = std::log10(*low / 1.4);
    high_ = std::log10(*high * 1.4);
  }
  double operator()(double value) const { return from_ + (std::log10(value) - low_) * per_decade(); }
  double per_decade() const { return (to_ - from_) / (high_ - low_); }
  double low() const { return std::pow(10, low_); }
  double high() const { return std::pow(10, high_); }

 private:
  double from_, to_, low_, high_;
};

/// The text of an SVG picture as it grows.
class Picture {
 public:
  void line(double x1, double y1, double x2, double y2, const char* colour, double width,
            bool dashed = false) {
    add(R"(<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" stroke="{}" stroke-width="{}"{}/>)", x1, y1,
        x2, y2, colour, width, dashed ? R"( stroke-dasharray="6 4")" : "");
  }
  void box(const Box& b, const char* fill, const char* stroke) {
    add(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="{}" stroke="{}"/>)", b.left,
        b.top, b.width, b.height, fill, stroke);
  }
  /// `anchor`: start, middle or end. `angle` in degrees, around (x, y).
  void text(double x, double y, double size, const char* anchor, const char* colour, std::string_view words,
            double angle = 0, bool bold = false) {
    add(R"(<text x="{:.1f}" y="{:.1f}" font-size="{}" text-anchor="{}" fill="{}"{}{}>{}</text>)", x, y, size,
        anchor, colour, bold ? R"( font-weight="bold")" : "",
        angle == 0 ? "" : fmt::format(R"-( transform="rotate({:.1f} {:.1f} {:.1f})")-", angle, x, y),
        escaped(words));
  }
  /// A disc for forward, a diamond for forward and backward.
  void mark(double x, double y, bool both) {
    const double r = mark_size * (both ? 1.25 : 1);
    if (both)
      add(R"(<path d="M{:.1f} {:.1f}l{} {} {} {} {} {}z" fill="{}" stroke="white" stroke-width="0.6"/>)", x,
          y - r, r, r, -r, r, -r, -r, both_colour);
    else
      add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{}" fill="{}" stroke="white" stroke-width="0.6"/>)", x, y, r,
          forward_colour);
  }
  std::string finished(double width, double height) const {
    return fmt::format(
        R"(<svg xmlns="http://www.w3.org/2000/svg" width="{0}" height="{1}" viewBox="0 0 {0} {1}" )"
        R"(font-family="DejaVu Sans, Helvetica, Arial, sans-serif"><rect width="{0}" height="{1}" fill="white"/>)"
        "\n{2}</svg>\n",
        width, height, body_);
  }

 private:
  template <typename... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    body_ += fmt::format(format, std::forward<Args>(args)...) + "\n";
  }
  std::string body_;
};

struct Point {
  int number;
  double x, y;
  bool both;
};

void draw_grid(Picture& picture, const Box& frame, const LogAxis& axis, bool vertical) {
  for (int power = static_cast<int>(std::floor(std::log10(axis.low()))); std::pow(10, power) < axis.high();
       ++power)
    for (int k = 1; k < 10; ++k) {
      const double value = k * std::pow(10, power), at = axis(value);
      if (value < axis.low() || value > axis.high()) continue;
      const char* colour = k == 1 ? "#c9ced6" : "#eef0f3";
      const std::string label = k == 1 || k == 2 || k == 5 ? fmt::format("{:g}", value) : "";
      if (vertical) {
        picture.line(frame.left, at, frame.left + frame.width, at, colour, 1);
        picture.text(frame.left - 6, at + 4, 11, "end", "#374151", label);
      } else {
        picture.line(at, frame.top, at, frame.top + frame.height, colour, 1);
        picture.text(at, frame.top + frame.height + 16, 11, "middle", "#374151", label);
      }
    }
}

/// Marks, and their numbers where there is room, with a thin line to those that stand off.
void draw_points(Picture& picture, LabelPlacer& placer, const std::vector<Point>& points) {
  constexpr double font = 9.5, digit = 6.2;
  for (const Point& point : points)
    placer.block({point.x - mark_size, point.y - mark_size, 2 * mark_size, 2 * mark_size});
  std::vector<Box> labels;
  for (const Point& point : points) {
    const std::string number = std::to_string(point.number);
    const Box label =
        placer.place(point.x, point.y, digit * static_cast<double>(number.size()) + 1, font - 0.5);
    labels.push_back(label);
    const double x = label.left + label.width / 2, y = label.top + label.height / 2;
    if (std::hypot(x - point.x, y - point.y) > 14) picture.line(point.x, point.y, x, y, "#9ca3af", 0.5);
  }
  for (const Point& point : points) picture.mark(point.x, point.y, point.both);
  for (std::size_t i = 0; i < points.size(); ++i)
    picture.text(labels[i].left + labels[i].width / 2, labels[i].top + labels[i].height - 1, font, "middle",
                 points[i].both ? both_colour : forward_colour, std::to_string(points[i].number));
}

/// Calls `visit(number, pass, both)` for every pass, with arithmetic or those without.
template <typename Visit>
void for_passes(std::span<const OpTiming> timings, bool arithmetic, const Visit& visit) {
  for (std::size_t i = 0; i < timings.size(); ++i)
    for (const Pass* pass : {&timings[i].forward, &timings[i].both})
      if (*pass && pass->bytes > 0 && (pass->flops > 0) == arithmetic)
        visit(static_cast<int>(i) + 1, *pass, pass == &timings[i].both);
}

/// A panel of GB/s alone: ops side by side in the order of the legend.
void draw_moves(Picture& picture, const Box& frame, std::span<const OpTiming> timings, const Limits& limits) {
  const double read = limits.read_bandwidth * 1e-9, triad = limits.triad_bandwidth * 1e-9;
  std::vector<double> rates = {read, triad};
  for_passes(timings, false,
             [&](int, const Pass& pass, bool) { rates.push_back(pass.gigabytes_per_second()); });
  const LogAxis y(rates, frame.top + frame.height, frame.top);
  draw_grid(picture, frame, y, true);
  picture.box(frame, "none", "#6b7280");
  LabelPlacer placer(frame);
  const auto ceiling = [&](double rate, bool above, const std::string& words) {
    picture.line(frame.left, y(rate), frame.left + frame.width, y(rate), roof_colour, above ? 1.8 : 1.2,
                 !above);
    const double baseline = y(rate) + (above ? -5 : 13);
    picture.text(frame.left + 6, baseline, 11, "start", roof_colour, words);
    placer.block({frame.left, baseline - 10, 125, 13});
  };
  ceiling(read, read >= triad, fmt::format("read {:.1f} GB/s", read));
  ceiling(triad, triad > read, fmt::format("triad {:.1f} GB/s", triad));
  std::vector<Point> points;
  const double step = (frame.width - 20) / static_cast<double>(rates.size() - 1);
  for_passes(timings, false, [&](int number, const Pass& pass, bool both) {
    const double x = frame.left + 10 + (static_cast<double>(points.size()) + 0.5) * step;
    points.push_back({number, x, y(pass.gigabytes_per_second()), both});
  });
  draw_points(picture, placer, points);
  const double middle = frame.left + frame.width / 2;
  picture.text(middle, frame.top - 8, 12, "middle", "#374151", "data moved, no arithmetic counted");
  picture.text(middle, frame.top + frame.height + 36, 12, "middle", "#374151", "ops side by side");
  picture.text(frame.left - 40, frame.top + frame.height / 2, 12, "middle", "#374151", "GB/s", -90);
}

/// The slope of a memory bandwidth, named along the line.
void draw_slope(Picture& picture, LabelPlacer& placer, const LogAxis& x, const LogAxis& y, double bandwidth,
                double flops, const std::string& words, bool above) {
  const double first = std::max(x.low(), y.low() / bandwidth), ridge = flops / bandwidth;
  picture.line(x(first), y(bandwidth * first), x(ridge), y(flops), roof_colour, above ? 1.8 : 1.2, !above);
  const double dx = x.per_decade(), dy = y.per_decade(), length = std::hypot(dx, dy);
  const double off = above ? -6 : 14;  // across the line
  const double end_x = x(ridge * 0.85) - off * dy / length,
               end_y = y(bandwidth * ridge * 0.85) + off * dx / length;
  picture.text(end_x, end_y, 11, "end", roof_colour, words, std::atan2(dy, dx) * 180 / std::numbers::pi);
  for (double along = 0; along < 6.6 * static_cast<double>(words.size()); along += 6)
    placer.block({end_x - along * dx / length - 5, end_y - along * dy / length - 9, 10, 10});
  for (double along = 0; along < 1; along += 0.004)
    placer.block({x(first) + along * (x(ridge) - x(first)) - 1,
                  y(bandwidth * first) + along * (y(flops) - y(bandwidth * first)) - 1, 2, 2});
}

void draw_roofline(Picture& picture, const Box& frame, std::span<const OpTiming> timings,
                   const Limits& limits) {
  const double peak = limits.peak_flops() * 1e-9, read = limits.read_bandwidth * 1e-9,
               triad = limits.triad_bandwidth * 1e-9, ridge = limits.peak_flops() / limits.bandwidth();
  std::vector<double> intensities = {0.1, ridge * 8}, rates = {peak / 100, peak * 1.2};
  for_passes(timings, true, [&](int, const Pass& pass, bool) {
    intensities.push_back(pass.intensity());
    rates.push_back(pass.gflops());
  });
  const LogAxis x(intensities, frame.left, frame.left + frame.width),
      y(rates, frame.top + frame.height, frame.top);
  draw_grid(picture, frame, x, false);
  draw_grid(picture, frame, y, true);
  picture.box(frame, "none", "#6b7280");
  LabelPlacer placer(frame);
  draw_slope(picture, placer, x, y, read, peak, fmt::format("memory, read: {:.1f} GB/s", read),
             read >= triad);
  draw_slope(picture, placer, x, y, triad, peak, fmt::format("memory, triad: {:.1f} GB/s", triad),
             triad > read);
  picture.line(x(ridge), y(peak), frame.left + frame.width, y(peak), roof_colour, 1.8);
  picture.text(frame.left + frame.width - 6, y(peak) - 6, 11, "end", roof_colour,
               fmt::format("fp32 FMA: {:.1f} GF/s", peak));
  placer.block({frame.left + frame.width - 160, y(peak) - 17, 160, 15});
  std::vector<Point> points;
  for_passes(timings, true, [&](int number, const Pass& pass, bool both) {
    points.push_back({number, x(pass.intensity()), y(pass.gflops()), both});
  });
  draw_points(picture, placer, points);
  const double middle = frame.left + frame.width / 2;
  picture.text(middle, frame.top - 8, 12, "middle", "#374151", "roofline");
  picture.text(middle, frame.top + frame.height + 36, 12, "middle", "#374151",
               "arithmetic intensity: FLOP per byte that must move");
  picture.text(frame.left - 46, frame.top + frame.height / 2, 12, "middle", "#374151", "GF/s", -90);
}

std::string rate_of(const Pass& pass) {
  if (!pass) return "-";
  return pass.flops > 0 ? fmt::format("{:.1f} GF/s", pass.gflops())
                        : fmt::format("{:.1f} GB/s", pass.gigabytes_per_second());
}

void draw_legend(Picture& picture, const Box& frame, std::span<const OpTiming> timings,
                 const Limits& limits) {
  const double number_x = frame.left + 22, name_x = frame.left + 32;
  const double pass_x[] = {frame.left + 243, frame.left + 388};
  const double header = frame.top - 8;
  picture.text(name_x, header, 11, "start", "#374151", "op", 0, true);
  picture.mark(pass_x[0] - 60, header - 4, false);
  picture.text(pass_x[0], header, 11, "end", forward_colour, "forward", 0, true);
  picture.mark(pass_x[1] - 78, header - 4, true);
  picture.text(pass_x[1], header, 11, "end", both_colour, "+ backward", 0, true);
  for (const double x : pass_x) picture.text(x + 44, header, 10, "end", "#6b7280", "of peak");
  for (std::size_t i = 0; i < timings.size(); ++i) {
    const double top = frame.top + legend_row * static_cast<double>(i), baseline = top + 10.5;
    if (i % 2 == 0) picture.box({frame.left, top, frame.width, legend_row}, "#f3f5f8", "none");
    picture.text(number_x, baseline, 10, "end", "#374151", std::to_string(i + 1), 0, true);
    picture.text(name_x, baseline, 10, "start", "#111827", timings[i].op_case->op);
    const Pass* passes[] = {&timings[i].forward, &timings[i].both};
    for (int p = 0; p < 2; ++p) {
      picture.text(pass_x[p], baseline, 10, "end", "#111827", rate_of(*passes[p]));
      if (*passes[p] && passes[p]->bytes > 0)
        picture.text(pass_x[p] + 44, baseline, 10, "end", "#6b7280",
                     fmt::format("{:.1f} %", passes[p]->percent_of_peak(limits)));
    }
  }
}

}  // namespace

std::string roofline_svg(std::span<const OpTiming> timings, const Limits& limits, const std::string& device) {
  const double rows = legend_row * static_cast<double>(timings.size());
  const double top = 96, plot_height = std::max(620.0, rows), width = 1560, height = top + plot_height + 60;
  Picture picture;
  picture.text(24, 32, 18, "start", "#111827", "Ops of vivant on " + device, 0, true);
  picture.text(24, 54, 12, "start", "#374151", describe(limits));
  draw_moves(picture, {76, top, 260, plot_height}, timings, limits);
  draw_roofline(picture, {410, top, 670, plot_height}, timings, limits);
  draw_legend(picture, {1104, top, 436, rows}, timings, limits);
  return picture.finished(width, height);
}

}  // namespace vivant::bench
