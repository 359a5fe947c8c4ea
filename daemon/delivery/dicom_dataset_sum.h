#pragma once

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <string>

#include "core/result.h"

namespace skullstation {

/// SHA-256 of the dataset in its transfer syntax (read_dicom_instance).
Result<std::string> dicom_dataset_sum(DcmDataset& dataset, const std::string& name);

/// DCMTK writes nothing to the terminal; its words come back with its errors.
void silence_dcmtk();

}  // namespace skullstation
