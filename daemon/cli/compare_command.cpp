#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/cli/commands.h"
#include "reconstruction/distance/comparison.h"
#include "reconstruction/distance/region_file.h"
#include "reconstruction/io/mesh_file.h"

namespace skullstation {

namespace {

const char* to_string(Alignment align) {
  switch (align) {
    case Alignment::none: return "none";
    case Alignment::rigid: return "rigid";
    case Alignment::similarity: return "similarity";
  }
  return "";
}

nlohmann::ordered_json json_of(const DistanceStatistics& s, double bin_mm) {
  return {{"area_mm2", s.area_mm2},
          {"samples", s.samples},
          {"mean_mm", s.mean_mm},
          {"rms_mm", s.rms_mm},
          {"median_mm", s.median_mm},
          {"p95_mm", s.p95_mm},
          {"max_mm", s.max_mm},
          {"signed_mean_mm", s.signed_mean_mm},
          {"histogram", {{"bin_mm", bin_mm}, {"share_of_area", s.histogram}}}};
}

std::string row_of(const char* way, const DistanceStatistics& s) {
  return fmt::format("{:<7}{:>9.3f}{:>9.3f}{:>9.3f}{:>9.3f}{:>9.3f}{:>9.3f}\n", way, s.mean_mm,
                     s.rms_mm, s.median_mm, s.p95_mm, s.max_mm, s.signed_mean_mm);
}

/// Shares of the area in ten classes up to the larger 95th percentile, and beyond it.
std::string histogram_of(const Comparison& comparison, double bin_mm) {
  const auto& a = comparison.a_to_b.histogram;
  const auto& b = comparison.b_to_a.histogram;
  const double p95_mm = std::max(comparison.a_to_b.p95_mm, comparison.b_to_a.p95_mm);
  constexpr std::size_t classes = 10;
  const auto bins = static_cast<std::size_t>(std::ceil(p95_mm / bin_mm));
  const std::size_t width = std::max<std::size_t>(1, (bins + classes - 1) / classes);
  const auto share = [](const std::vector<double>& histogram, std::size_t begin, std::size_t end) {
    double sum = 0.0;
    for (std::size_t i = begin; i < std::min(end, histogram.size()); ++i) sum += histogram[i];
    return 100.0 * sum;
  };
  std::string text = "distance [mm]     A to B   B to A\n";
  for (std::size_t c = 0; c <= classes; ++c) {
    const std::size_t begin = c * width;
    if (begin >= a.size()) break;
    const bool last = c == classes || begin + width >= a.size();
    const std::size_t end = last ? a.size() : begin + width;
    const double from_mm = static_cast<double>(begin) * bin_mm;
    text += last ? fmt::format("{:>5.1f} and more", from_mm)
                 : fmt::format("{:>5.1f} to {:>5.1f}", from_mm, static_cast<double>(end) * bin_mm);
    text += fmt::format("{:>9.1f} %{:>7.1f} %\n", share(a, begin, end), share(b, begin, end));
    if (last) break;
  }
  return text;
}

Result<void> write_colored(TriangleMesh mesh, const Comparison& comparison,
                           const CompareCommand& command, const std::vector<bool>& region) {
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    mesh.vertices.row(v) = comparison.b_from_a * Eigen::Vector3d(mesh.vertices.row(v));
  }
  mesh.normals = vertex_normals(mesh);
  mesh = colored_by_distance(std::move(mesh), comparison.vertex_distance_a_mm,
                             command.full_color_mm, region);
  return write_mesh(mesh, command.out);
}

}  // namespace

Result<CommandReport> run(const CompareCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  ComparisonOptions options;
  options.threads = common.threads;
  options.align = command.align;
  if (!command.out.empty() && command.out.extension() != ".ply" &&
      command.out.extension() != ".glb") {
    return fail(ErrorKind::usage, command.out.string(),
                "a coloured mesh's name ends in .ply or .glb");
  }
  progress.report(0.0, "reading");
  const auto a = read_mesh(command.a);
  if (!a) return forward(a);
  const auto b = read_mesh(command.b);
  if (!b) return forward(b);
  if (!command.region.empty()) {
    auto region = read_region(command.region, static_cast<int>(a->vertices.rows()));
    if (!region) return forward(region);
    options.region = *std::move(region);
  }
  const auto comparison = compare_surfaces(*a, *b, options, progress.part(0.1, 0.95));
  if (!comparison) return forward(comparison);
  if (!command.out.empty()) {
    if (const auto written = write_colored(*a, *comparison, command, options.region); !written) {
      return forward(written);
    }
  }

  CommandReport report;
  report.text = fmt::format("{:<7}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}\n", "[mm]", "mean", "RMS",
                            "median", "P95", "max", "signed") +
                row_of("A to B", comparison->a_to_b) + row_of("B to A", comparison->b_to_a) + "\n" +
                histogram_of(*comparison, options.histogram_bin_mm);
  if (options.align == Alignment::similarity) {
    report.text += fmt::format("\nA was scaled by {:.5f}\n", comparison->b_from_a.scale);
  }
  nlohmann::ordered_json json = {{"a", command.a.string()},
                                 {"b", command.b.string()},
                                 {"align", to_string(command.align)},
                                 {"b_from_a", matrix_rows(comparison->b_from_a.matrix())},
                                 {"scale", comparison->b_from_a.scale},
                                 {"a_to_b", json_of(comparison->a_to_b, options.histogram_bin_mm)},
                                 {"b_to_a", json_of(comparison->b_to_a, options.histogram_bin_mm)},
                                 {"hausdorff_mm", comparison->hausdorff_mm}};
  if (!command.out.empty()) {
    json["colored_mesh"] = command.out.string();
    json["full_color_mm"] = command.full_color_mm;
    report.text += fmt::format(
        "\n{}: A coloured by its distance from B, blue inside, red outside, full at {} mm\n",
        command.out.string(), command.full_color_mm);
  }
  report.json = json.dump(2);
  return report;
}

}  // namespace skullstation
