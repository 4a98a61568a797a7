//! Samples, their table and their page.

mod page;
mod table;
mod task;
mod watch;
