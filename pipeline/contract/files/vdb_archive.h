#pragma once
// OpenVDB files as bytes in memory, so that writing, checking and hashing are our own.

#include <openvdb/Grid.h>

#include <string>
#include <string_view>

namespace drench {

/// Registers OpenVDB's types, once; before any grid is made.
void initialize_vdb();

/// Grids as a .vdb file, Blosc-compressed. OpenVDB puts a random UUID into the header; here it is
/// the digest of everything else, so that equal grids give equal bytes and damage shows.
std::string vdb_bytes(const openvdb::GridCPtrVec& grids);

/// The first grid in bytes that vdb_bytes made. @throws std::runtime_error with the reason if the
/// bytes are damaged or were not made by it.
openvdb::GridBase::Ptr vdb_grid(std::string_view bytes);

}  // namespace drench
