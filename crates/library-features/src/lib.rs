//! No code: the manifest asks for the features of libraries that several parts of fieldgap need, so that each library is compiled once.
