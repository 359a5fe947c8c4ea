#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/result.h"
#include "daemon/delivery/package_objects.h"

namespace skullstation {

/// Writes a package as one FHIR R4 transaction to `work`: the unidentified person (Patient), the
/// report with its bytes and the package with its sum (DocumentReference). Each is to be made only
/// if there is none with its identifier (ifNoneExist). The object's sum is fhir_sum() of its
/// documents.
Result<std::vector<DeliveryObject>> write_fhir_bundle(const SealedPackage& package,
                                                      const std::filesystem::path& work);

/// The same with one small document and no person.
Result<DeliveryObject> write_fhir_probe(const std::string& station,
                                        const std::filesystem::path& work);

/// The DocumentReferences of a Bundle, in its order.
std::vector<nlohmann::ordered_json> fhir_documents(const nlohmann::ordered_json& bundle);

/// "system|value" of the first identifier; empty if there is none.
std::string fhir_identifier(const nlohmann::ordered_json& resource);

/// What must come back unchanged of the documents: identifiers, titles, sizes, sums, and the bytes
/// that they carry.
std::string fhir_sum(const std::vector<nlohmann::ordered_json>& documents);

}  // namespace skullstation
