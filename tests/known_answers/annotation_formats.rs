//! Files for annotation tools are read back as a data set.

use std::{fs, path::Path};

use lookdown::annotation_formats::{AnnotatedBox, AnnotatedImage, AnnotationFormat, BoxKind};
use lookdown_detect::detection::BBox;
use lookdown_eval::{AnnotatedPerson, DataSet, Outline, RotatedBox};
use lookdown_lens::geometry::{OrientedBox, Pixel};

fn image(file_name: &str, left: f64) -> AnnotatedImage {
    AnnotatedImage {
        file_name: file_name.to_owned(),
        width: 960,
        height: 960,
        calibration: Some("office".to_owned()),
        persons: vec![AnnotatedBox {
            bbox: BBox::new([left, 20.5, left + 40.25, 90.0]).unwrap(),
            oriented_box: OrientedBox::turned(Pixel::new(30.0, 55.0), 40.0, 70.0, 0.2),
            score: 0.9,
            floor: None,
        }],
    }
}

fn write(format: AnnotationFormat, images: &[AnnotatedImage], folder: &Path) {
    for file in format.files(images, BoxKind::AxisParallel) {
        let path = folder.join(file.path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, file.content).unwrap();
    }
}

#[test]
fn coco_with_calibrations_is_read_back_as_a_data_set() {
    let folder = tempfile::tempdir().unwrap();
    let calibrations = folder.path().join("calibrations");
    fs::create_dir(&calibrations).unwrap();
    let office = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/samples/calibrations/office.json"
    );
    fs::copy(office, calibrations.join("office.json")).unwrap();
    let images = [image("a.jpg", 10.25), image("hall/b.jpg", 300.0)];
    write(AnnotationFormat::Coco, &images, folder.path());

    let data_set = DataSet::open(folder.path()).unwrap();
    assert!(data_set.images[1].path.ends_with("images/hall/b.jpg"));
    assert!(
        data_set
            .images
            .iter()
            .all(|image| image.calibration.is_some())
    );
    assert_same_persons(&data_set, &images);
}

#[test]
fn cepdof_with_images_is_read_back_with_its_angles() {
    let folder = tempfile::tempdir().unwrap();
    let images = [image("a.jpg", 10.25), image("hall/b.jpg", 300.0)];
    for image in &images {
        let path = folder.path().join(&image.file_name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "").unwrap();
    }
    write(AnnotationFormat::Cepdof, &images, folder.path());

    let data_set = DataSet::open(folder.path()).unwrap();
    assert_eq!(data_set.images.len(), 2);
    for read in &data_set.images {
        let [person] = &read.truth.persons[..] else {
            panic!("{:?}", read.truth.persons);
        };
        let Outline::Rotated(rotated) = person.outline else {
            panic!("{:?}", person.outline);
        };
        let written =
            RotatedBox::new([30.0, 55.0, 40.0, 70.0], 11.46_f64.to_radians(), [960; 2]).unwrap();
        assert_eq!(rotated, written);
    }
}

#[test]
fn voc_with_images_is_read_back_as_a_data_set() {
    let folder = tempfile::tempdir().unwrap();
    let images = [image("a & b.jpg", 10.25), image("hall/c.jpg", 300.0)];
    for image in &images {
        let path = folder.path().join("images").join(&image.file_name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "").unwrap();
    }
    write(AnnotationFormat::Voc, &images, folder.path());

    let data_set = DataSet::open(folder.path()).unwrap();
    assert_eq!(data_set.images[0].size, Some([960, 960]));
    assert_same_persons(&data_set, &images);
}

#[track_caller]
fn assert_same_persons(data_set: &DataSet, images: &[AnnotatedImage]) {
    assert_eq!(data_set.images.len(), images.len());
    for (read, written) in data_set.images.iter().zip(images) {
        let expected = AnnotatedPerson::from(Outline::AxisParallel(written.persons[0].bbox));
        assert_eq!(read.truth.persons, [expected]);
    }
}
