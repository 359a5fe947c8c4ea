#include "tests/unit/volume/dicom_edit.h"

#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmImageWriter.h>
#include <gdcmReader.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmWriter.h>

#include <cstdio>
#include <stdexcept>

namespace skullstation::testing {

namespace {

gdcm::DataElement text_element(std::uint16_t group, std::uint16_t element, gdcm::VR::VRType type,
                               std::string value) {
  if (value.size() % 2 == 1) value += type == gdcm::VR::UI ? '\0' : ' ';
  gdcm::DataElement entry(gdcm::Tag(group, element));
  entry.SetVR(type);
  entry.SetByteValue(value.data(), gdcm::VL(static_cast<std::uint32_t>(value.size())));
  return entry;
}

gdcm::DataElement short_element(std::uint16_t group, std::uint16_t element, int value) {
  gdcm::DataElement entry(gdcm::Tag(group, element));
  entry.SetVR(gdcm::VR::US);
  const auto stored = static_cast<std::uint16_t>(value);
  entry.SetByteValue(reinterpret_cast<const char*>(&stored), 2);
  return entry;
}

/// A sequence with one item.
gdcm::DataElement sequence(std::uint16_t group, std::uint16_t element,
                           const std::vector<gdcm::DataSet>& items) {
  gdcm::SmartPointer<gdcm::SequenceOfItems> list = new gdcm::SequenceOfItems();
  list->SetLengthToUndefined();
  for (const gdcm::DataSet& data : items) {
    gdcm::Item item;
    item.SetVLToUndefined();
    item.SetNestedDataSet(data);
    list->AddItem(item);
  }
  gdcm::DataElement entry(gdcm::Tag(group, element));
  entry.SetVR(gdcm::VR::SQ);
  entry.SetValue(*list);
  entry.SetVLToUndefined();
  return entry;
}

gdcm::DataSet data_set(const std::vector<gdcm::DataElement>& elements) {
  gdcm::DataSet data;
  for (const gdcm::DataElement& element : elements) data.Insert(element);
  return data;
}

std::string joined(std::initializer_list<double> numbers) {
  std::string text;
  for (const double number : numbers) {
    char word[32];
    std::snprintf(word, sizeof word, "%s%.11g", text.empty() ? "" : "\\", number);
    text += word;
  }
  return text;
}

}  // namespace

struct DicomEdit::File {
  gdcm::Reader reader;
  gdcm::DataSet& data() { return reader.GetFile().GetDataSet(); }
};

DicomEdit::DicomEdit(const std::filesystem::path& path) : file_(std::make_unique<File>()) {
  file_->reader.SetFileName(path.c_str());
  if (!file_->reader.Read()) throw std::runtime_error("no DICOM: " + path.string());
}

DicomEdit::~DicomEdit() = default;

void DicomEdit::set(std::uint16_t group, std::uint16_t element, std::string value) {
  const gdcm::Tag tag(group, element);
  const gdcm::VR type = file_->data().GetDataElement(tag).GetVR();
  file_->data().Replace(text_element(group, element, type, std::move(value)));
  if (group == 0x0008 && element == 0x0016) {
    file_->reader.GetFile().GetHeader().Remove(gdcm::Tag(0x0002, 0x0002));
  }
}

void DicomEdit::remove(std::uint16_t group, std::uint16_t element) {
  file_->data().Remove(gdcm::Tag(group, element));
}

void DicomEdit::fill_unused_bits() {
  const gdcm::Tag tag(0x7fe0, 0x0010);
  gdcm::DataElement pixels = file_->data().GetDataElement(tag);
  std::string bytes(pixels.GetByteValue()->GetPointer(), pixels.GetByteValue()->GetLength());
  for (std::size_t i = 1; i < bytes.size(); i += 2) bytes[i] = static_cast<char>(bytes[i] | '\xf0');
  pixels.SetByteValue(bytes.data(), gdcm::VL(static_cast<std::uint32_t>(bytes.size())));
  file_->data().Replace(pixels);
}

void DicomEdit::halve_pixels() {
  const gdcm::Tag tag(0x7fe0, 0x0010);
  gdcm::DataElement pixels = file_->data().GetDataElement(tag);
  const std::string bytes(pixels.GetByteValue()->GetPointer(),
                          pixels.GetByteValue()->GetLength() / 2);
  pixels.SetByteValue(bytes.data(), gdcm::VL(static_cast<std::uint32_t>(bytes.size())));
  file_->data().Replace(pixels);
}

void DicomEdit::save(const std::filesystem::path& path) {
  gdcm::Writer writer;
  writer.SetFile(file_->reader.GetFile());
  writer.SetFileName(path.c_str());
  if (!writer.Write()) throw std::runtime_error("not written: " + path.string());
}

void transcode(const std::filesystem::path& path, TransferSyntax syntax) {
  gdcm::ImageReader reader;
  reader.SetFileName(path.c_str());
  if (!reader.Read()) throw std::runtime_error("no image: " + path.string());
  gdcm::ImageChangeTransferSyntax change;
  switch (syntax) {
    case TransferSyntax::jpeg_lossless:
      change.SetTransferSyntax(gdcm::TransferSyntax::JPEGLosslessProcess14_1);
      break;
    case TransferSyntax::rle: change.SetTransferSyntax(gdcm::TransferSyntax::RLELossless); break;
    case TransferSyntax::jpeg_ls_lossless:
      change.SetTransferSyntax(gdcm::TransferSyntax::JPEGLSLossless);
      break;
  }
  change.SetInput(reader.GetImage());
  if (!change.Change()) throw std::runtime_error("not transcoded: " + path.string());
  gdcm::ImageWriter writer;
  writer.SetFileName(path.c_str());
  writer.SetFile(reader.GetFile());
  writer.SetImage(change.GetOutput());
  if (!writer.Write()) throw std::runtime_error("not written: " + path.string());
}

void write_enhanced_ct(const Volume& volume, const std::filesystem::path& path,
                       const std::vector<int>& order) {
  using gdcm::VR;
  const VoxelGrid& grid = volume.grid;
  const Eigen::Vector3d row = grid.direction.col(0);
  const Eigen::Vector3d column = grid.direction.col(1);
  const gdcm::DataSet shared = data_set({
      sequence(0x0020, 0x9116,
               {data_set({text_element(
                   0x0020, 0x0037, VR::DS,
                   joined({row.x(), row.y(), row.z(), column.x(), column.y(), column.z()}))})}),
      sequence(0x0028, 0x9110,
               {data_set({text_element(0x0018, 0x0050, VR::DS, "1"),
                          text_element(0x0028, 0x0030, VR::DS,
                                       joined({grid.spacing_mm.y(), grid.spacing_mm.x()}))})}),
      sequence(0x0028, 0x9145,
               {data_set({text_element(0x0028, 0x1052, VR::DS, "-1024"),
                          text_element(0x0028, 0x1053, VR::DS, "1"),
                          text_element(0x0028, 0x1054, VR::LO, "HU")})}),
  });
  std::vector<gdcm::DataSet> frames;
  std::string pixels;
  for (const int k : order) {
    const Eigen::Vector3d p = grid.patient_from_voxel({0, 0, static_cast<double>(k)});
    frames.push_back(data_set({sequence(
        0x0020, 0x9113,
        {data_set({text_element(0x0020, 0x0032, VR::DS, joined({p.x(), p.y(), p.z()}))})})}));
    for (int j = 0; j < grid.size.y(); ++j) {
      for (int i = 0; i < grid.size.x(); ++i) {
        const auto stored = static_cast<std::uint16_t>(volume.at(i, j, k) + 1024);
        pixels += static_cast<char>(stored & 255);
        pixels += static_cast<char>(stored >> 8);
      }
    }
  }
  gdcm::Writer writer;
  gdcm::DataSet& data = writer.GetFile().GetDataSet();
  for (const auto& element :
       {text_element(0x0008, 0x0016, VR::UI, "1.2.840.10008.5.1.4.1.1.2.1"),
        text_element(0x0008, 0x0018, VR::UI, "2.25.1"), text_element(0x0008, 0x0060, VR::CS, "CT"),
        text_element(0x0020, 0x000d, VR::UI, "2.25.2"),
        text_element(0x0020, 0x000e, VR::UI, "2.25.3"), short_element(0x0028, 0x0002, 1),
        text_element(0x0028, 0x0004, VR::CS, "MONOCHROME2"),
        text_element(0x0028, 0x0008, VR::IS, std::to_string(order.size())),
        short_element(0x0028, 0x0010, grid.size.y()), short_element(0x0028, 0x0011, grid.size.x()),
        short_element(0x0028, 0x0100, 16), short_element(0x0028, 0x0101, 12),
        short_element(0x0028, 0x0102, 11), short_element(0x0028, 0x0103, 0),
        sequence(0x5200, 0x9229, {shared}), sequence(0x5200, 0x9230, frames)}) {
    data.Insert(element);
  }
  gdcm::DataElement pixel_data(gdcm::Tag(0x7fe0, 0x0010));
  pixel_data.SetVR(VR::OW);
  pixel_data.SetByteValue(pixels.data(), gdcm::VL(static_cast<std::uint32_t>(pixels.size())));
  data.Insert(pixel_data);
  writer.GetFile().GetHeader().SetDataSetTransferSyntax(
      gdcm::TransferSyntax::ExplicitVRLittleEndian);
  writer.SetFileName(path.c_str());
  if (!writer.Write()) throw std::runtime_error("not written: " + path.string());
}

}  // namespace skullstation::testing
