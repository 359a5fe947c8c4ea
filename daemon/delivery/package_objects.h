#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"
#include "daemon/delivery/target.h"
#include "daemon/evidence/bag_manifest.h"

namespace skullstation {

/// What a delivery must know of a sealed package.
struct SealedPackage {
  std::filesystem::path folder;
  std::string case_number;
  std::string station;  ///< may be empty
  /// Of its two manifests one after the other: changes with any byte of the package, the seals'
  /// too.
  std::string sha256;
  std::vector<ManifestLine> files;  ///< all of them; bagit.txt last

  /// Its name at receivers that hold files: case number and the beginning of the sum.
  std::string remote_name() const;
};

/// Reads the manifests, not the files. Fails if it is no package.
Result<SealedPackage> read_sealed_package(const std::filesystem::path& folder);

/// What the target has to hold of the package, in the order of sending. Files stay where they are;
/// objects that are made for the target (DICOM, FHIR) are written to `work`, the same bytes each
/// time.
Result<std::vector<DeliveryObject>> objects_for(const TargetConfig& target,
                                                const SealedPackage& package,
                                                const std::filesystem::path& work);

/// A small object of the same kind, to try a target with.
Result<DeliveryObject> probe_for(const TargetConfig& target, const std::string& station,
                                 const std::filesystem::path& work);

/// One sum for all: of the objects' names and sums.
std::string sum_of(const std::vector<DeliveryObject>& objects);

}  // namespace skullstation
