//! Lookdown finds people in the pictures of ceiling fisheye cameras.

pub mod geometry;
