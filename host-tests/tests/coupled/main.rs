//! The coupled filter against dense matrices of both targets, and by its properties; joint association with unresolved pairs against
//! the list of all events.

mod association;
#[path = "../support/counting.rs"]
mod counting;
mod dense;
mod properties;
mod scene;
mod tracker;
mod work;
