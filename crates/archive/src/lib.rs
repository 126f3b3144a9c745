//! An index of all records below a folder, and queries of it.
