//! The size of a block of pixels, which one node of the grid begins and one vector covers in width.

/// Positions are exact at every so many view pixels, across and down.
pub(super) const NODE_STEP: u32 = 8;
/// Pixels rendered at once: from node to node.
pub(super) const LANES: usize = NODE_STEP as usize;
