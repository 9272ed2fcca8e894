//! Head points with their images.

use super::super::test_support::{folder, open, refusal};
use super::*;

const CSV: &str = "omni_1A/Ground_Truth_Annotations/groundTruth_omni1A_test2.csv";
const FIRST: &str = "omni_1A/omni1A_test2/2015-05-12T12-42-29.320Z.jpg";
const SECOND: &str = "omni_1A/omni1A_test2/2015-05-12T12-42-29.420Z.jpg";

fn sequence(rows: &str) -> tempfile::TempDir {
    folder(&[
        (CSV, rows),
        (SECOND, ""),
        (FIRST, ""),
        ("omni_1A/omni1A_test3/x.jpg", ""),
    ])
}

#[test]
fn rows_belong_to_the_images_in_the_order_of_their_names() {
    let folder = sequence("1,120,80,300,410.5,0,0\r\n2,0,0,,,-1,-1\n\n");
    let file = folder.path().join(CSV);
    for data_set in [open(&folder), DataSet::open(&file).unwrap()] {
        assert_eq!(data_set.scoring, Scoring::HeadPoint);
        let [first, second] = &data_set.images[..] else {
            panic!("two images")
        };
        let heads = [[120.0, 80.0], [300.0, 410.5]].map(Outline::Head);
        assert_eq!(first.truth.persons, heads.map(AnnotatedPerson::from));
        assert!(first.path.ends_with(FIRST));
        let id = "omni1A_test2/2015-05-12T12-42-29.320Z.jpg";
        assert_eq!(first.id.to_string(), id);
        assert!(second.truth.persons.is_empty());
    }
}

#[test]
fn errors_name_the_row_and_the_problem() {
    for (rows, expected) in [
        ("1,2,3", "it has 1 rows, but "),
        ("1,2,3\n2,x,3", "row 2: \"x\" is not a coordinate"),
        ("1,inf,3\n2", "row 1: \"inf\" is not a coordinate"),
        ("1,2,3\n2,4", "row 2: it has an x without a y"),
    ] {
        let error = refusal(&sequence(rows));
        assert!(error.contains("groundTruth_omni1A_test2.csv: "), "{error}");
        assert!(error.contains(expected), "{error}");
    }
    let error = refusal(&folder(&[("groundTruth_a.csv", "1,2,3")]));
    assert!(error.contains("there is no folder a/"), "{error}");
}
