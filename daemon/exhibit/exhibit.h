#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/result.h"

namespace skullstation {

/// What a museum says of what it shows; all may be empty.
struct ExhibitLabel {
  std::string holder;      ///< the institution
  std::string rights;      ///< a sentence: "© Museum of Bones, CC BY-NC 4.0"
  std::string rights_url;  ///< of the licence: creativecommons.org or rightsstatements.org
  std::string base_url;    ///< below which the folder will be served; empty: no IIIF manifest
};

/// Writes a folder that can be put on a web server, made of a sealed package's skull and head:
///   skull.glb, head.glb      as sealed, with who, what, whose and which package in their metadata
///                            (asset.extras, asset.copyright, KHR_xmp_json_ld)
///   scene.svx.json           both in one scene of the Smithsonian's Voyager, in one frame, in mm
///   preview_*.png            the case's pictures
///   manifest.json            IIIF Presentation 3: the pictures, the models beside them
/// Returns the files' names. The folder appears whole or not at all. Errors: bad_input (no
/// package, not as it was sealed, of something else than a case with a head), usage (`out` is
/// there).
Result<std::vector<std::string>> write_exhibit(const std::filesystem::path& package,
                                               const ExhibitLabel& label,
                                               const std::string& program_version,
                                               const std::filesystem::path& out,
                                               const Progress& progress = {});

}  // namespace skullstation
