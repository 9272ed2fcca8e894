//! The sources of frames.

mod jpeg_splitter;
mod multipart;
