#include "reconstruction/statistics/subject_file.h"

#include <cmath>
#include <limits>
#include <utility>

#include "reconstruction/statistics/hdf5_group.h"

namespace skullstation {

namespace {

using Eigen::Index;

constexpr const char* format_name = "skullstation-fitted-subject/1";
constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

NumberTable table_of(const Points3& points) {
  return {std::vector<double>(points.data(), points.data() + points.size()), points.rows(), 3,
          false};
}

Result<Points3> points_from(const Hdf5Reader& file, const std::string& path) {
  const auto numbers = file.table(path);
  if (!numbers) return forward(numbers);
  if (numbers->columns != 3) {
    return fail(ErrorKind::bad_input, path, "does not hold points", "delete the file");
  }
  return Points3(Eigen::Map<const Points3>(numbers->values.data(), numbers->rows, 3));
}

std::optional<double> known(double value) {
  if (std::isnan(value)) return std::nullopt;
  return value;
}

}  // namespace

Result<std::string> encode_subject(const StoredSubject& stored) {
  const ModelSubject& subject = stored.subject;
  Hdf5Writer file;
  file.attribute("/", "format", format_name);
  file.text("/key", stored.key);
  file.text("/name", subject.name);
  file.table("/skull", table_of(subject.skull), StoredNumber::float64);
  NumberTable observed;
  for (const bool seen : subject.skull_observed) observed.values.push_back(seen ? 1.0 : 0.0);
  observed.rows = static_cast<Index>(observed.values.size());
  file.table("/skull_observed", observed, StoredNumber::uint8);
  file.table("/head", table_of(subject.head), StoredNumber::float64);
  const Eigen::VectorXd& depths = subject.tissue_mm;
  file.table(
      "/tissue_mm",
      {std::vector<double>(depths.data(), depths.data() + depths.size()), depths.size(), 1, true},
      StoredNumber::float64);
  file.table("/male_age_bmi",
             {{subject.facts.male.value_or(unknown), subject.facts.age_years.value_or(unknown),
               subject.facts.body_mass_index.value_or(unknown)},
              3,
              1,
              true},
             StoredNumber::float64);
  return file.finish();
}

Result<StoredSubject> decode_subject(std::string bytes, const std::string& name) {
  const auto file = Hdf5Reader::open(std::move(bytes), name);
  if (!file) return forward(file);
  const auto format = file->attribute("/", "format");
  if (!format || *format != format_name) {
    return fail(ErrorKind::bad_input, name, "is no fitted subject of this version",
                "delete the file");
  }
  StoredSubject stored;
  const auto key = file->text("/key");
  if (!key) return forward(key);
  stored.key = *key;
  const auto subject_name = file->text("/name");
  if (!subject_name) return forward(subject_name);
  stored.subject.name = *subject_name;
  const auto skull = points_from(*file, "/skull");
  if (!skull) return forward(skull);
  stored.subject.skull = *skull;
  const auto head = points_from(*file, "/head");
  if (!head) return forward(head);
  stored.subject.head = *head;
  const auto observed = file->table("/skull_observed");
  if (!observed) return forward(observed);
  for (const double seen : observed->values) stored.subject.skull_observed.push_back(seen != 0.0);
  const auto depths = file->table("/tissue_mm");
  if (!depths) return forward(depths);
  stored.subject.tissue_mm = Eigen::Map<const Eigen::VectorXd>(
      depths->values.data(), static_cast<Index>(depths->values.size()));
  const auto facts = file->table("/male_age_bmi");
  if (!facts) return forward(facts);
  if (facts->values.size() != 3) {
    return fail(ErrorKind::bad_input, name + ":/male_age_bmi", "does not hold three numbers",
                "delete the file");
  }
  stored.subject.facts.male = known(facts->values[0]);
  stored.subject.facts.age_years = known(facts->values[1]);
  stored.subject.facts.body_mass_index = known(facts->values[2]);
  return stored;
}

}  // namespace skullstation
