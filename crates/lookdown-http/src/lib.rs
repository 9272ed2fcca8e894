//! The HTTP listener of all parts of Lookdown: the server, its metrics port, `lookdown count` and
//! the metrics of `lookdown watch`.
//!
//! [`server`] accepts connections within limits. The other modules are the layers in front of every
//! route: [`host`], [`csrf`], [`keys`], [`header_limits`], [`page_headers`], [`problem`]. The
//! server adds layers of its own; [`protect`] is the complete set for the companions. [`openapi`]
//! has the common parts of the API documents.

pub mod csrf;
pub mod entity_tags;
pub mod header_limits;
pub mod host;
pub mod keys;
pub mod openapi;
pub mod page_headers;
pub mod problem;
pub mod protect;
pub mod request_id;
pub mod server;
mod shutdown;
mod unread_responses;

pub use shutdown::Shutdown;
