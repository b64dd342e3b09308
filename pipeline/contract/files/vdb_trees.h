#pragma once
// Trees that OpenVDB's library holds compiled: it registers their types, so that every function of
// theirs is in it. Where this is included before they are used they are not compiled again, which
// takes 7 s a type and unit (docs/decisions/0201-openvdb-compiled-once.md).

#include <openvdb/Grid.h>
#include <openvdb/openvdb.h>

namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME {

extern template class tree::Tree<BoolTree::RootNodeType>;
extern template class tree::Tree<FloatTree::RootNodeType>;
extern template class tree::Tree<Int32Tree::RootNodeType>;
extern template class tree::Tree<Vec3STree::RootNodeType>;
extern template class Grid<BoolTree>;
extern template class Grid<FloatTree>;
extern template class Grid<Int32Tree>;
extern template class Grid<Vec3STree>;

}  // namespace OPENVDB_VERSION_NAME
}  // namespace openvdb
