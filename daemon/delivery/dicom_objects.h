#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "daemon/delivery/package_objects.h"

namespace skullstation {

/// Writes a package's content as one DICOM study of an unidentified person to `work`: the skull and
/// the head as Encapsulated STL [mm], the report as Encapsulated PDF, the photographs (at most
/// `max_photographs`, evenly spread) as VL Photographic Images. What a package does not hold is
/// left out; a package with none of it fails. The same package gives the same bytes and UIDs.
Result<std::vector<DeliveryObject>> write_dicom_objects(const SealedPackage& package,
                                                        std::optional<int> max_photographs,
                                                        const std::filesystem::path& work);

/// A small Encapsulated PDF, the same one each time for a station.
Result<DeliveryObject> write_dicom_probe(const std::string& station,
                                         const std::filesystem::path& work);

/// A UID "2.25.…" (DICOM PS3.5 B.2) that the text alone decides.
std::string uid_of(const std::string& text);

}  // namespace skullstation
