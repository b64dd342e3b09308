#pragma once
// Trees that OpenVDB's library holds compiled, since it registers their types. Where this is
// included before they are used they are not compiled again, which takes 7 s a type and unit
// (docs/decisions/0201-openvdb-compiled-once.md).
//
// Functions that its compiler inlines everywhere are not in the library: only code that inlines
// them, too, links.

#include <openvdb/Grid.h>
#include <openvdb/openvdb.h>

namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME {

#if defined(__OPTIMIZE__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
extern template class tree::Tree<BoolTree::RootNodeType>;
extern template class tree::Tree<FloatTree::RootNodeType>;
extern template class tree::Tree<Int32Tree::RootNodeType>;
extern template class tree::Tree<Vec3STree::RootNodeType>;
extern template class Grid<BoolTree>;
extern template class Grid<FloatTree>;
extern template class Grid<Int32Tree>;
extern template class Grid<Vec3STree>;
#endif

}  // namespace OPENVDB_VERSION_NAME
}  // namespace openvdb
