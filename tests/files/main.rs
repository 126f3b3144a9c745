//! Files of other people, and what is wrong with them.

mod bad_input;
mod foreign_records;
mod outside_text;
#[path = "../small_record/mod.rs"]
mod small_record;
mod unusual_files;
