//! How a crate's source is cut: its modules, which file names items of which
//! other file, and what can be counted about it.
//!
//! Everything is read from the text with `syn`; nothing is compiled. Code that
//! is built for tests alone is left out everywhere.

pub mod circles;
pub mod constants;
pub mod items;
pub mod lines;
pub mod tree;
pub mod tuples;
pub mod uses;
pub mod words;
