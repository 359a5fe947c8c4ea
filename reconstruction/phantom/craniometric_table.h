#pragma once

#include <Eigen/Core>
#include <span>
#include <string_view>

namespace skullstation {

enum class Sex { male, female };

/// A measure of the skull, with its mean and standard deviation over mankind as far as the source
/// holds it [mm]: the length between two landmarks (canonical_landmarks) or the distance of a third
/// from the line through them.
struct Craniometric {
  std::string_view code;  ///< Howells's
  std::string_view name;
  std::string_view from;
  std::string_view to;
  std::string_view subtense_of;  ///< the third landmark; empty for a length
  double male_mean_mm;
  double male_sd_mm;
  double female_mean_mm;
  double female_sd_mm;

  double mean_mm(Sex sex) const { return sex == Sex::male ? male_mean_mm : female_mean_mm; }
  double sd_mm(Sex sex) const { return sex == Sex::male ? male_sd_mm : female_sd_mm; }
};

/// The measures that a person's skull is drawn by; sources in the table's file. The mastoid height
/// (MDH) counts along the vertical only.
std::span<const Craniometric> craniometric_table();

/// Their correlation (#measures x #measures).
Eigen::MatrixXd craniometric_correlation();

}  // namespace skullstation
