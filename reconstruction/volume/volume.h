#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace skullstation {

/// Where voxels lie in the patient (DICOM LPS: +x left, +y posterior, +z superior).
struct VoxelGrid {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();           ///< voxels along i, j, k
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Ones();     ///< between centres
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();      ///< centre of voxel (0, 0, 0)
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();  ///< unit columns: where i, j, k go

  std::size_t count() const {
    return static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()) *
           static_cast<std::size_t>(size.z());
  }
  /// i runs fastest, then j, then k.
  std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(size.y()) +
            static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(size.x()) +
           static_cast<std::size_t>(i);
  }
  Eigen::Vector3d patient_from_voxel(const Eigen::Vector3d& voxel) const {
    return origin_mm + direction * voxel.cwiseProduct(spacing_mm);
  }
  Eigen::Vector3d voxel_from_patient(const Eigen::Vector3d& point_mm) const {
    return (direction.transpose() * (point_mm - origin_mm)).cwiseQuotient(spacing_mm);
  }
};

/// Who was scanned. Kept on request only.
struct PatientIdentity {
  std::string name;
  std::string id;
  std::string birth_date;
  std::string study_date;
  std::string study_uid;
  std::string series_uid;
  std::string series_description;
};

/// What a file says about its scan, without what would tell the patient's identity.
struct VolumeInfo {
  std::string format;  ///< "DICOM", "NIfTI", "NRRD", "MetaImage"
  std::string manufacturer;
  std::string scanner_model;
  std::string convolution_kernel;
  std::optional<double> tube_voltage_kv;
  std::optional<double> slice_thickness_mm;
  std::string sex;  ///< "M", "F", "O" or empty
  std::optional<int> age_years;
  std::optional<double> body_mass_index;  ///< no volume file tells it; the one who imports may
  std::optional<PatientIdentity> identity;
  /// What the reader had to correct or assume, a sentence each.
  std::vector<std::string> warnings;
};

/// A CT volume in Hounsfield units.
struct Volume {
  VoxelGrid grid;
  std::vector<std::int16_t> hu;
  VolumeInfo info;

  std::int16_t at(int i, int j, int k) const { return hu[grid.index(i, j, k)]; }
  std::int16_t& at(int i, int j, int k) { return hu[grid.index(i, j, k)]; }
};

/// The same volume with its axes renamed and turned round so that i goes (nearly) left, j posterior
/// and k superior. No voxel is interpolated; the direction becomes right-handed.
Volume oriented_to_patient_axes(Volume volume);

/// SHA-256 over size, geometry and voxels: the same scan has the same hash, whatever file it came
/// in.
std::string volume_sha256(const Volume& volume);

}  // namespace skullstation
