#include "reconstruction/io/mesh_file.h"

#include <algorithm>
#include <string>

#include "reconstruction/io/glb.h"
#include "reconstruction/io/obj.h"
#include "reconstruction/io/ply.h"
#include "reconstruction/io/stl.h"

namespace skullstation {

namespace {

std::string lower_case_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; });
  return extension;
}

}  // namespace

Result<TriangleMesh> read_mesh(const std::filesystem::path& path) {
  const std::string extension = lower_case_extension(path);
  if (extension == ".ply") return read_ply(path);
  if (extension == ".obj") return read_obj(path);
  if (extension == ".stl") return read_stl(path);
  return fail(ErrorKind::bad_input, path.string(), "is not a mesh by its name",
              "name a .ply, .obj or .stl file");
}

Result<void> write_mesh(const TriangleMesh& mesh, const std::filesystem::path& path) {
  const std::string extension = lower_case_extension(path);
  if (extension == ".ply") return write_ply(mesh, path);
  if (extension == ".obj") return write_obj(mesh, path);
  if (extension == ".stl") return write_stl(mesh, path);
  if (extension == ".glb") return write_glb(mesh, path);
  return fail(ErrorKind::usage, path.string(), "no mesh format has this extension",
              "name a .ply, .obj, .stl or .glb file");
}

}  // namespace skullstation
