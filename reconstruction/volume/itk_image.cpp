#include "reconstruction/volume/itk_image.h"

#include <fmt/format.h>
#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <type_traits>

namespace skullstation {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t most_voxels = 2'000'000'000;

tl::unexpected<Error> bad(const fs::path& path, std::string what) {
  return fail(ErrorKind::bad_input, path.string(), std::move(what));
}

itk::ImageIOBase::Pointer reader_for(ImageFormat format) {
  switch (format) {
    case ImageFormat::nifti: return itk::NiftiImageIO::New().GetPointer();
    case ImageFormat::nrrd: return itk::NrrdImageIO::New().GetPointer();
    case ImageFormat::meta_image: return itk::MetaImageIO::New().GetPointer();
  }
  return nullptr;
}

int dictionary_number(const itk::ImageIOBase& io, const char* key) {
  std::string text;
  itk::ExposeMetaData<std::string>(io.GetMetaDataDictionary(), key, text);
  return std::atoi(text.c_str());
}

Result<void> read_geometry(const itk::ImageIOBase& io, const fs::path& path, ItkImage& image) {
  const unsigned dimensions = io.GetNumberOfDimensions();
  bool one_volume = dimensions >= 3 && io.GetNumberOfComponents() == 1;
  for (unsigned d = 3; d < dimensions; ++d) one_volume = one_volume && io.GetDimensions(d) == 1;
  if (!one_volume) return bad(path, "is not one 3-D volume of grey values");
  double voxels = 1.0;
  for (unsigned a = 0; a < 3; ++a) {
    image.size[a] = io.GetDimensions(a);
    image.spacing[a] = io.GetSpacing(a);
    image.origin[a] = io.GetOrigin(a);
    std::ranges::copy_n(io.GetDirection(a).begin(), 3, image.direction[a].begin());
    voxels *= static_cast<double>(image.size[a]);
    if (image.size[a] < 2) return bad(path, fmt::format("has one voxel only along axis {}", a));
  }
  if (voxels > static_cast<double>(most_voxels)) {
    return bad(path, fmt::format("claims {:.3g} voxels, more than any head scan has", voxels));
  }
  image.xyzt_units = dictionary_number(io, "xyzt_units");
  image.qform_code = dictionary_number(io, "qform_code");
  image.sform_code = dictionary_number(io, "sform_code");
  return {};
}

template <class Stored>
Result<void> read_values(itk::ImageIOBase& io, const fs::path& path, ItkImage& image) {
  if constexpr (std::is_same_v<Stored, std::int16_t>) {
    io.Read(image.values.data());
  } else {
    std::vector<Stored> stored(image.values.size());
    io.Read(stored.data());
    for (std::size_t i = 0; i < stored.size(); ++i) {
      const auto value = static_cast<double>(stored[i]);
      if (!std::isfinite(value)) return bad(path, fmt::format("voxel {} is not finite", i));
      const double held = std::clamp(value, double(std::numeric_limits<std::int16_t>::min()),
                                     double(std::numeric_limits<std::int16_t>::max()));
      if (held != value) ++image.cut_off;
      image.values[i] = static_cast<std::int16_t>(std::lround(held));
    }
  }
  return {};
}

Result<void> read_values(itk::ImageIOBase& io, const fs::path& path, ItkImage& image) {
  using Type = itk::IOComponentEnum;
  switch (io.GetComponentType()) {
    case Type::UCHAR: return read_values<unsigned char>(io, path, image);
    case Type::CHAR: return read_values<signed char>(io, path, image);
    case Type::USHORT: return read_values<unsigned short>(io, path, image);
    case Type::SHORT: return read_values<std::int16_t>(io, path, image);
    case Type::UINT: return read_values<unsigned int>(io, path, image);
    case Type::INT: return read_values<int>(io, path, image);
    case Type::FLOAT: return read_values<float>(io, path, image);
    case Type::DOUBLE: return read_values<double>(io, path, image);
    default: return bad(path, "its voxels are of a type that no CT has");
  }
}

Result<ItkImage> read(itk::ImageIOBase& io, const fs::path& path) {
  io.SetFileName(path.string());
  io.ReadImageInformation();
  ItkImage image;
  if (const auto read = read_geometry(io, path, image); !read) return forward(read);
  itk::ImageIORegion region(io.GetNumberOfDimensions());
  for (unsigned d = 0; d < io.GetNumberOfDimensions(); ++d) {
    region.SetSize(d, io.GetDimensions(d));
  }
  io.SetIORegion(region);
  image.values.resize(image.size[0] * image.size[1] * image.size[2]);
  if (const auto read = read_values(io, path, image); !read) return forward(read);
  return image;
}

}  // namespace

Result<ItkImage> read_with_itk(const fs::path& path, ImageFormat format) {
  try {
    return read(*reader_for(format), path);
  } catch (const itk::ExceptionObject& error) {
    return bad(path, fmt::format("can't be read: {}", error.GetDescription()));
  } catch (const std::exception& error) {
    return bad(path, fmt::format("can't be read: {}", error.what()));
  }
}

Result<void> write_nifti_with_itk(const ItkImage& image, const fs::path& path) {
  try {
    const auto io = itk::NiftiImageIO::New();
    io->SetFileName(path.string());
    io->SetNumberOfDimensions(3);
    io->SetPixelType(itk::IOPixelEnum::SCALAR);
    io->SetComponentType(itk::IOComponentEnum::SHORT);
    io->SetNumberOfComponents(1);
    itk::ImageIORegion region(3);
    for (unsigned a = 0; a < 3; ++a) {
      io->SetDimensions(a, image.size[a]);
      io->SetSpacing(a, image.spacing[a]);
      io->SetOrigin(a, image.origin[a]);
      io->SetDirection(a,
                       std::vector<double>(image.direction[a].begin(), image.direction[a].end()));
      region.SetSize(a, image.size[a]);
    }
    io->SetIORegion(region);
    io->Write(image.values.data());
    return {};
  } catch (const itk::ExceptionObject& error) {
    return bad(path, fmt::format("can't be written: {}", error.GetDescription()));
  } catch (const std::exception& error) {
    return bad(path, fmt::format("can't be written: {}", error.what()));
  }
}

}  // namespace skullstation
