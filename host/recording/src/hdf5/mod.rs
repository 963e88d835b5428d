//! Reader of HDF5 files as MATLAB, `hdf5storage` and `h5py` write them: groups, attributes and datasets of numbers,
//! texts and references, plain or in chunks with deflate, shuffle and Fletcher's checksum.
//!
//! Format: The HDF Group, "HDF5 File Format Specification", version 3.0. It reads superblocks of versions 0 to 3,
//! object headers of versions 1 and 2, groups with symbol tables or a few links, and the trees of version 1 of chunks;
//! what HDF5 1.10 and later writes only on request is refused with its name. Datasets in chunks have one or two
//! dimensions.
//!
//! The file states addresses and sizes; each block is checked against the length of the file before memory is taken for
//! it, and all headers together against a multiple of that length, so that circles end. The bound on the values is that
//! of the caller. This room knows nothing of MATLAB.

mod attribute;
mod cursor;
mod dataset;
mod datatype;
mod fault;
mod file;
mod filters;
mod group;
mod object;
mod storage;
mod tree;

pub(super) use dataset::Dataset;
pub(super) use datatype::Datatype;
pub(super) use fault::Fault;
pub(super) use file::Hdf5;
pub(super) use group::Link;
pub(super) use object::Object;
pub(super) use storage::Bytes;
