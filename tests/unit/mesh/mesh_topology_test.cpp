#include "reconstruction/mesh/mesh_topology.h"

#include <gmock/gmock.h>

namespace skullstation {
namespace {

using testing::ElementsAre;

/// Two triangles that share the edge from vertex 1 to vertex 2, and a lone vertex.
Triangles two_triangles() {
  Triangles triangles(2, 3);
  triangles << 0, 1, 2,  //
      2, 1, 3;
  return triangles;
}

TEST(BoundaryEdges, AreThoseOfOneTriangle) {
  EXPECT_THAT(boundary_edges(two_triangles()),
              ElementsAre(ElementsAre(true, false, true), ElementsAre(false, true, true)));
}

TEST(BoundaryVertices, AreTheEndsOfBoundaryEdges) {
  EXPECT_THAT(boundary_vertices(two_triangles(), 5), ElementsAre(true, true, true, true, false));
}

TEST(BoundaryVertices, AClosedMeshHasNone) {
  Triangles tetrahedron(4, 3);
  tetrahedron << 0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3;
  EXPECT_THAT(boundary_vertices(tetrahedron, 4), ElementsAre(false, false, false, false));
}

}  // namespace
}  // namespace skullstation
