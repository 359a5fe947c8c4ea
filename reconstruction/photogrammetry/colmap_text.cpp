#include <fmt/format.h>

#include <charconv>
#include <fstream>
#include <map>
#include <sstream>

#include "reconstruction/photogrammetry/colmap_model.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

/// The lines of a COLMAP text file that are no comments.
class Lines {
 public:
  explicit Lines(fs::path file) : file_(std::move(file)), in_(file_) {}

  bool is_open() const { return in_.is_open(); }
  bool next(std::string& line) {
    while (std::getline(in_, line)) {
      ++number_;
      if (!line.starts_with('#')) return true;
    }
    return false;
  }
  tl::unexpected<Error> bad(const std::string& expected) const {
    return fail(ErrorKind::bad_input, fmt::format("{}:{}", file_.string(), number_),
                "is not " + expected);
  }
  tl::unexpected<Error> missing() const {
    return fail(ErrorKind::bad_input, file_.string(), "can't be read");
  }

 private:
  fs::path file_;
  std::ifstream in_;
  int number_ = 0;
};

std::optional<std::size_t> index_of(const std::string& image_name, std::size_t count) {
  std::size_t index = 0;
  const auto [end, error] =
      std::from_chars(image_name.data(), image_name.data() + image_name.size(), index);
  if (error != std::errc() || index >= count || image_name != colmap_image_name(index)) {
    return std::nullopt;
  }
  return index;
}

/// COLMAP's cameras by their numbers.
Result<std::map<int, Lens>> read_cameras(const fs::path& file) {
  Lines lines(file);
  if (!lines.is_open()) return lines.missing();
  std::map<int, Lens> cameras;
  for (std::string line; lines.next(line);) {
    std::istringstream words(line);
    int id = 0;
    int width = 0;
    int height = 0;
    std::string model;
    std::array<double, 8> numbers{};
    words >> id >> model >> width >> height;
    for (double& number : numbers) words >> number;
    if (!words || model != "OPENCV") return lines.bad("a camera of model OPENCV");
    cameras[id] =
        Lens::from_params(width, height, LensModel::opencv, {numbers.begin(), numbers.end()});
  }
  return cameras;
}

/// Where the features of each of COLMAP's images lie, and which of ours it is.
struct Features {
  std::size_t image = 0;
  std::vector<Eigen::Vector2d> positions_px;
};

Result<std::map<int, Features>> read_images(const fs::path& file, std::span<const SfmImage> images,
                                            const std::map<int, Lens>& lenses, SfmModel& model) {
  Lines lines(file);
  if (!lines.is_open()) return lines.missing();
  std::map<int, Features> features;
  for (std::string line; lines.next(line);) {
    std::istringstream words(line);
    int id = 0;
    int camera = 0;
    std::string name;
    Rigid3 pose;
    Eigen::Quaterniond& q = pose.rotation;
    Eigen::Vector3d& t = pose.translation;
    words >> id >> q.w() >> q.x() >> q.y() >> q.z() >> t.x() >> t.y() >> t.z() >> camera >> name;
    const auto index = index_of(name, images.size());
    const auto lens = lenses.find(camera);
    if (!words || !index || lens == lenses.end()) return lines.bad("an image of this model");
    q.normalize();
    model.camera_from_model[*index] = pose;
    model.lenses[static_cast<std::size_t>(images[*index].camera)] = lens->second;
    Features& of = features[id];
    of.image = *index;
    if (!lines.next(line)) return lines.bad("followed by the image's features");
    std::istringstream numbers(line);
    Eigen::Vector2d position;
    for (long long point = 0; numbers >> position.x() >> position.y() >> point;) {
      of.positions_px.push_back(position);
    }
  }
  return features;
}

Result<void> read_points(const fs::path& file, const std::map<int, Features>& features,
                         SfmModel& model) {
  Lines lines(file);
  if (!lines.is_open()) return lines.missing();
  for (std::string line; lines.next(line);) {
    std::istringstream words(line);
    long long id = 0;
    std::array<double, 3> color{};
    double error = 0.0;
    SfmPoint point;
    words >> id >> point.x_model.x() >> point.x_model.y() >> point.x_model.z();
    words >> color[0] >> color[1] >> color[2] >> error;
    if (!words) return lines.bad("a point");
    std::size_t feature = 0;
    for (int image = 0; words >> image >> feature;) {
      const auto of = features.find(image);
      if (of == features.end() || feature >= of->second.positions_px.size()) {
        return lines.bad("a point seen by images of this model");
      }
      point.sights.push_back(
          {static_cast<int>(of->second.image), of->second.positions_px[feature]});
    }
    model.points.push_back(std::move(point));
  }
  return {};
}

}  // namespace

std::string colmap_image_name(std::size_t index) { return fmt::format("{:06}.png", index); }

Result<SfmModel> read_colmap_model(const fs::path& folder, std::span<const SfmImage> images,
                                   std::span<const SfmCamera> cameras) {
  SfmModel model;
  model.camera_from_model.resize(images.size());
  model.lenses.resize(cameras.size());
  const auto lenses = read_cameras(folder / "cameras.txt");
  if (!lenses) return forward(lenses);
  const auto features = read_images(folder / "images.txt", images, *lenses, model);
  if (!features) return forward(features);
  if (const auto read = read_points(folder / "points3D.txt", *features, model); !read) {
    return forward(read);
  }
  return model;
}

}  // namespace skullstation
