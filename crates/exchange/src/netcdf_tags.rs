//! Numbers of NetCDF's classic format.

pub(crate) const DIMENSIONS: u32 = 0x0a;
pub(crate) const VARIABLES: u32 = 0x0b;
pub(crate) const ATTRIBUTES: u32 = 0x0c;

pub(crate) const BYTE: u32 = 1;
pub(crate) const CHAR: u32 = 2;
pub(crate) const SHORT: u32 = 3;
pub(crate) const INT: u32 = 4;
pub(crate) const FLOAT: u32 = 5;
pub(crate) const DOUBLE: u32 = 6;
pub(crate) const UBYTE: u32 = 7;
pub(crate) const USHORT: u32 = 8;
pub(crate) const UINT: u32 = 9;
pub(crate) const INT64: u32 = 10;
pub(crate) const UINT64: u32 = 11;
