//! Samples, their table and their page.

mod page;
mod promise;
mod table;
mod task;
mod watch;
