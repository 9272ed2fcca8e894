//! Valid outputs for every code path of every head.

/// A manifest and the matching shapes of the outputs `a` and `b`, for an input of 8×4 pixels.
pub(super) type Case = (&'static str, &'static [usize], &'static [usize]);

/// Placeholder for the number of views in the shapes below.
pub(super) const N: usize = usize::MAX;

/// One case for every code path of every head.
pub(super) const CASES: [Case; 10] = [
    (
        "head = 'boxes_scores'\nboxes = 'a'\nscores = 'b'",
        &[N, 5, 4],
        &[N, 5],
    ),
    (
        "head = 'yolo_v2'\nperson_class = 1\nanchors = [[1, 2]]\nname = 'a'",
        &[N, 7, 2, 4],
        &[N],
    ),
    (
        "head = 'yolox'\nperson_class = 0\nstrides = [4, 8]\nname = 'a'",
        &[N, 3, 6],
        &[],
    ),
    (
        "head = 'yolox'\nperson_class = 0\nstrides = [4]\nname = 'a'\nscore_activation = 'sigmoid'\ndecode_in_graph = true",
        &[N, 2, 6],
        &[1],
    ),
    (
        "head = 'nanodet'\nperson_class = 0\nstrides = [4]\nreg_max = 1\nname = 'a'",
        &[N, 2, 9],
        &[0],
    ),
    (
        "head = 'yolo_v8'\nperson_class = 0\nstrides = [4]\nname = 'a'",
        &[N, 5, 2],
        &[N, 5, 2],
    ),
    (
        "head = 'yolo_v8'\nperson_class = 0\nstrides = [4]\nname = 'a'\nlayout = 'cells_first'",
        &[N, 2, 5],
        &[N],
    ),
    ("head = 'detr'\nperson_class = 1", &[N, 3, 4], &[N, 3, 2]),
    (
        "head = 'detr'\nperson_class = 1\nscore_activation = 'none'",
        &[N, 3, 2],
        &[N, 3, 4],
    ),
    (
        "head = 'end_to_end'\nperson_class = 1\nname = 'a'\ncolumns = ['view', 'x_min', 'y_min', 'x_max', 'y_max', 'class', 'score']",
        &[8, 7],
        &[N],
    ),
];
