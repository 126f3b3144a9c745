//! Numbers of MATLAB's level 5 MAT-file.

pub(crate) const INT8: u32 = 1;
pub(crate) const UINT8: u32 = 2;
pub(crate) const INT16: u32 = 3;
pub(crate) const UINT16: u32 = 4;
pub(crate) const INT32: u32 = 5;
pub(crate) const UINT32: u32 = 6;
pub(crate) const SINGLE: u32 = 7;
pub(crate) const DOUBLE: u32 = 9;
pub(crate) const INT64: u32 = 12;
pub(crate) const UINT64: u32 = 13;
pub(crate) const MATRIX: u32 = 14;
pub(crate) const COMPRESSED: u32 = 15;

pub(crate) const STRUCT_CLASS: u32 = 2;
pub(crate) const CHAR_CLASS: u32 = 4;
pub(crate) const DOUBLE_CLASS: u32 = 6;
pub(crate) const SINGLE_CLASS: u32 = 7;
pub(crate) const INT32_CLASS: u32 = 12;
pub(crate) const UINT64_CLASS: u32 = 15;
