//! Pixels: decoding with limits, finding the lens circle, remap tables, network input, drawing.

pub mod annotate;
pub mod decode;
pub mod frame;
pub mod lens_circle;
mod letterbox;
mod network_input;
mod remap_table;

pub use frame::Frame;
pub use letterbox::Letterbox;
pub use network_input::{ChannelOrder, NetworkInput, ViewBatch};
pub use remap_table::RemapTable;
