#pragma once

#include <map>
#include <string>

#include "daemon/evidence/block_list.h"
#include "daemon/evidence/package_source.h"

namespace skullstation {

/// What was made from what, by which program and version, with which options and model, as
/// PROV-JSON (W3C Member Submission, 2013): entities are the sealed files and what they were made
/// from, activities are scan, reconstruction and approximation. Only what case, session and
/// reconstruction recorded; where a link is not recorded, none is drawn.
std::string provenance_json(const PackageContent& content,
                            const std::map<std::string, FileDigest>& sealed);

/// metadata.json: case, station, what the package holds, who signs it, the case's own warnings and
/// the model's card. `sealed_with`: the seals that must be in signature/.
std::string metadata_json(const PackageContent& content,
                          const std::vector<std::string>& sealed_with,
                          const std::string& ed25519_fingerprint,
                          const std::string& certificate_fingerprint);

/// bag-info.txt (RFC 8493, 2.2.2). Without a date: that is the signature's.
std::string bag_info(const PackageContent& content);

}  // namespace skullstation
