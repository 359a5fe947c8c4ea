#include "capture/simulation/render.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "capture/simulation/view_tracer.h"
#include "core/parallel.h"
#include "core/units.h"

namespace skullstation {

namespace {

using Eigen::Vector3f;

constexpr int tile_px = 16;

/// The samples of a pixel so far.
struct PixelSum {
  Vector3f radiance = Vector3f::Zero();
  float least_light = std::numeric_limits<float>::infinity();
  float most_light = 0.0F;
  std::uint8_t objects = 0;  ///< one bit for each SceneObject
  std::uint8_t lamps_seen = 0;
  std::uint8_t lamps_hidden = 0;
  std::uint8_t lamps_behind = 0;
  std::uint8_t count = 0;

  void add(const TracedSample& sample) {
    radiance += sample.radiance;
    least_light = std::min(least_light, sample.light);
    most_light = std::max(most_light, sample.light);
    objects |= static_cast<std::uint8_t>(1U << static_cast<unsigned>(sample.object));
    lamps_seen |= sample.lamps_seen;
    lamps_hidden |= sample.lamps_hidden;
    lamps_behind |= sample.lamps_behind;
    ++count;
  }
  /// An outline, the edge of a shadow or a sharp turn of the surface runs through it.
  bool uneven(float contrast) const {
    return (objects & (objects - 1)) != 0 || (lamps_hidden & (lamps_seen | lamps_behind)) != 0 ||
           most_light - least_light > contrast * (most_light + least_light);
  }
};

struct Tiles {
  int width, height;

  int across() const { return (width + tile_px - 1) / tile_px; }
  int count() const { return across() * ((height + tile_px - 1) / tile_px); }
  template <class Work>
  void for_pixels(int tile, const Work& work) const {
    const int left = tile % across() * tile_px;
    const int top = tile / across() * tile_px;
    for (int y = top; y < std::min(height, top + tile_px); ++y) {
      for (int x = left; x < std::min(width, left + tile_px); ++x) work(x, y);
    }
  }
};

/// Natural vignetting: cos^4 of the angle to the optical axis.
float vignette(const PreparedOptics& optics, int x, int y) {
  const double squared = optics.ray(x + 0.5, y + 0.5).squaredNorm();
  return static_cast<float>(std::pow(1.0 + squared, -2.0 * optics.optics().vignetting));
}

}  // namespace

Result<void> RenderOptions::validate() const {
  const auto bad = [](const char* option, const std::string& what) {
    return fail(ErrorKind::bad_input, fmt::format("simulated camera, {}", option), what);
  };
  if (samples < 1 || samples > SampleTable::points ||
      !std::has_single_bit(static_cast<unsigned>(samples))) {
    return bad("samples", fmt::format("must be a power of two up to {}", SampleTable::points));
  }
  const auto refines = [&](int more) {
    return more >= samples && more <= SampleTable::points &&
           std::has_single_bit(static_cast<unsigned>(more));
  };
  const auto must_refine =
      fmt::format("must be a power of two from samples to {}", SampleTable::points);
  if (!refines(samples_where_uneven)) return bad("samples_where_uneven", must_refine);
  if (!refines(samples_at_outlines)) return bad("samples_at_outlines", must_refine);
  if (!(uneven_light >= 0.0)) return bad("uneven_light", "must not be negative");
  return {};
}

ImageF render_radiance(const PlacedScene& scene, const PreparedOptics& optics,
                       std::span<const double> table_angles_deg, const RenderOptions& options) {
  const Lens& lens = optics.optics().lens;
  const std::vector<Lamp> lamps = make_lamps(scene.parts->options.lights);
  const std::vector<TableMap> lamps_seen = lamps_seen_from_table(
      scene, lamps, table_angles_deg[table_angles_deg.size() / 2], options.threads);
  const Tiles tiles{lens.width, lens.height};
  std::vector<PixelSum> sums(static_cast<std::size_t>(lens.width) * lens.height);
  const auto sum_of = [&](int x, int y) -> PixelSum& {
    return sums[static_cast<std::size_t>(y) * lens.width + x];
  };
  /// Returns whether any of the samples saw more than the backdrop.
  const auto trace = [&](std::span<const PixelSample> samples, bool lamps_in_turn) {
    ViewTracer tracer(scene, optics, lamps, lamps_seen, table_angles_deg, options);
    std::vector<TracedSample> traced(samples.size());
    tracer.trace(samples, lamps_in_turn, traced);
    bool table_seen = false;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      sum_of(samples[i].x, samples[i].y).add(traced[i]);
      table_seen = table_seen || traced[i].object != SceneObject::backdrop;
    }
    return table_seen;
  };

  parallel_for(tiles.count(), options.threads, [&](int tile) {
    std::vector<PixelSample> first;
    std::vector<PixelSample> others;
    tiles.for_pixels(tile, [&](int x, int y) {
      first.push_back({x, y, 0, options.samples});
      for (int i = 1; i < options.samples; ++i) others.push_back({x, y, i, options.samples});
    });
    const bool lamps_in_turn = options.samples >= 4;
    // The backdrop is smooth: where a tile shows nothing else, one sample of a pixel says all. An
    // outline just outside the tile has the pixels beside it looked at again below.
    if (trace(first, lamps_in_turn)) trace(others, lamps_in_turn);
  });

  // Again, with more samples, where the first ones disagree, and beside such pixels: there the
  // first few may have missed an edge. Starting afresh keeps the choice from biasing the result.
  std::vector<char> uneven(sums.size());
  std::transform(sums.begin(), sums.end(), uneven.begin(), [&](const PixelSum& sum) {
    return sum.uneven(static_cast<float>(options.uneven_light)) ? 1 : 0;
  });
  const auto samples_needed = [&](int x, int y) {
    const std::uint8_t objects = sum_of(x, y).objects;
    bool beside_uneven = false;
    for (int j = std::max(0, y - 1); j <= std::min(lens.height - 1, y + 1); ++j) {
      for (int i = std::max(0, x - 1); i <= std::min(lens.width - 1, x + 1); ++i) {
        const std::size_t at = static_cast<std::size_t>(j) * lens.width + i;
        if (!std::has_single_bit(static_cast<std::uint8_t>(sums[at].objects | objects))) {
          return options.samples_at_outlines;
        }
        beside_uneven = beside_uneven || uneven[at] != 0;
      }
    }
    return beside_uneven ? options.samples_where_uneven : options.samples;
  };
  std::vector<std::uint8_t> needed(sums.size());
  parallel_for(lens.height, options.threads, [&](int y) {
    for (int x = 0; x < lens.width; ++x) {
      needed[static_cast<std::size_t>(y) * lens.width + x] =
          static_cast<std::uint8_t>(samples_needed(x, y));
    }
  });
  parallel_for(tiles.count(), options.threads, [&](int tile) {
    std::vector<PixelSample> samples;
    tiles.for_pixels(tile, [&](int x, int y) {
      const int count = needed[static_cast<std::size_t>(y) * lens.width + x];
      if (count == options.samples) return;
      sum_of(x, y) = {};
      for (int i = 0; i < count; ++i) samples.push_back({x, y, i, count});
    });
    if (!samples.empty()) trace(samples, false);
  });

  ImageF image(lens.width, lens.height, 3);
  parallel_for(lens.height, options.threads, [&](int y) {
    for (int x = 0; x < lens.width; ++x) {
      const PixelSum& sum = sum_of(x, y);
      const float factor = vignette(optics, x, y) / static_cast<float>(sum.count);
      for (int channel = 0; channel < 3; ++channel) {
        image.at(x, y, channel) = std::max(0.0F, factor * sum.radiance[channel]);
      }
    }
  });
  return image;
}

ViewTruth render_truth(const PlacedScene& scene, const PreparedOptics& optics,
                       double table_angle_deg, int threads) {
  const Lens& lens = optics.optics().lens;
  const Rigid3 table_from_camera =
      (optics.optics().camera_from_station * rotation_about_z(table_angle_deg)).inverse();
  const bool specimen = scene.table_from_specimen.has_value();
  const Rigid3 specimen_from_table = specimen ? scene.table_from_specimen->inverse() : Rigid3{};
  ViewTruth truth{ImageF(lens.width, lens.height, 1), Image8(lens.width, lens.height, 1)};
  parallel_for(lens.height, threads, [&](int y) {
    std::vector<SpecimenRay> rays;
    std::vector<ShadingPoint> points;
    for (int x = 0; x < lens.width; ++x) {
      const Eigen::Vector3d along = optics.ray(x + 0.5, y + 0.5).homogeneous();
      SightRay ray;
      ray.origin = table_from_camera.translation;
      ray.direction = table_from_camera.rotation * along.normalized();
      points.push_back(hit_table(scene, ray));
      rays.push_back({specimen_from_table * ray.origin,
                      specimen_from_table.rotation * ray.direction,
                      std::min(points.back().distance_mm, 1e6)});
    }
    std::vector<SpecimenHit> hits(rays.size());
    if (specimen) scene.parts->surface->intersect(rays, hits);
    for (int x = 0; x < lens.width; ++x) {
      SceneObject object = points[x].object;
      double distance = points[x].distance_mm;
      if (hits[x].triangle >= 0) {
        object = SceneObject::specimen;
        distance = hits[x].distance_mm;
      }
      truth.object.at(x, y) = static_cast<std::uint8_t>(object);
      if (object != SceneObject::backdrop) {
        const double stretch = optics.ray(x + 0.5, y + 0.5).homogeneous().norm();
        truth.depth_mm.at(x, y) = static_cast<float>(distance / stretch);
      }
    }
  });
  return truth;
}

}  // namespace skullstation
