//! The image library: decoding, drawing, frames and lens circles.

mod annotate;
mod decode;
mod frame;
mod lens_circle;
