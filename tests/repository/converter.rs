//! Facts that the converter of the models shares with the server.

use std::fs;

use lookdown_detect::inference::CandidateOptions;

#[test]
fn nanodet_decodes_as_many_cells_as_a_view_has_candidates() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/lab/training/networks/nanodet.py"
    );
    let cells = CandidateOptions::DEFAULT.max_detections_per_view;
    let declaration = format!("\nBEST_CELLS = {cells}\n");
    assert!(
        fs::read_to_string(path).unwrap().contains(&declaration),
        "{path} does not declare{declaration}"
    );
}
