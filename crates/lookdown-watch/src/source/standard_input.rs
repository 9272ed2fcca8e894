//! Images on standard input: one image, or JPEG files one after another.

use bytes::Bytes;
use lookdown_common::{JPEG_START, jpeg_length};
use tokio::io::{AsyncRead, AsyncReadExt};

use super::sink::Sink;
use crate::{MAX_FRAME_BYTES, SourceError, image_splitter::ImageSplitter};

/// Reads images from a stream.
pub struct ImageReader<R> {
    input: R,
    splitter: ImageSplitter,
    /// True for a stream of JPEG files. `None` until its first bytes arrive.
    is_jpeg: Option<bool>,
}

impl<R: AsyncRead + Unpin> ImageReader<R> {
    /// Creates a reader of a stream.
    pub fn new(input: R) -> Self {
        Self {
            input,
            splitter: ImageSplitter::new(MAX_FRAME_BYTES),
            is_jpeg: None,
        }
    }

    /// Returns the next image, or `None` at the end of the stream.
    ///
    /// # Errors
    /// [`SourceError`] if the stream cannot be read, or holds other bytes after the images.
    pub async fn next_image(&mut self) -> Result<Option<Bytes>, SourceError> {
        loop {
            if self.is_jpeg == Some(true)
                && let Some(image) = self.splitter.next_file()
            {
                return Ok(Some(image));
            }
            if self.splitter.buffer().len() > MAX_FRAME_BYTES {
                return Err(SourceError::TooLarge);
            }
            let buffer = self.splitter.buffer();
            let read = self.input.read_buf(buffer).await.map_err(|error| {
                SourceError::Unreadable("standard input".to_owned(), error.to_string())
            })?;
            if self.is_jpeg.is_none() && buffer.len() >= JPEG_START.len() {
                self.is_jpeg = Some(buffer.starts_with(JPEG_START));
            }
            if read == 0 {
                let rest = buffer.split();
                // The last JPEG of the stream may lack its end marker.
                let is_image = self.is_jpeg == Some(false) || jpeg_length(&rest).is_some();
                return Ok((is_image && !rest.is_empty()).then(|| rest.freeze()));
            }
        }
    }
}

/// Reads frames until standard input ends.
pub(super) async fn run(sink: &Sink<'_>) -> Result<(), SourceError> {
    let mut images = ImageReader::new(tokio::io::stdin());
    while let Some(image) = images.next_image().await? {
        sink.accept(image)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const JPEG: &[u8] = b"\xff\xd8\xff\xda\x00\x02xyz\xff\xd9";

    async fn images(stream: &[u8]) -> Vec<Bytes> {
        let mut reader = ImageReader::new(stream);
        let mut images = Vec::new();
        while let Some(image) = reader.next_image().await.unwrap() {
            images.push(image);
        }
        images
    }

    #[tokio::test]
    async fn concatenated_jpeg_files_are_separate_images() {
        assert_eq!(images(&[JPEG, JPEG, JPEG].concat()).await, [JPEG; 3]);
    }

    #[tokio::test]
    async fn jpeg_files_may_lack_their_end_marker() {
        let whole = include_bytes!("../../../../tests/fixtures/images/grey.jpg");
        let unended = &whole[..whole.len() - 2];
        let found = images(&[unended, b"dhav\0", unended].concat()).await;
        assert_eq!(found.len(), 2);
        for image in found {
            assert!(image.starts_with(unended));
            assert!(crate::Frame::new(image, jiff::Timestamp::UNIX_EPOCH).is_ok());
        }
        // Bytes of the image itself are missing.
        let cut = &whole[..whole.len() - 3];
        assert!(images(&[cut, cut].concat()).await.is_empty());
    }

    #[tokio::test]
    async fn another_format_is_one_image_up_to_the_end() {
        let png = b"\x89PNG\r\n\x1a\n..\xff\xd8\xff..";
        assert_eq!(images(png).await, [png.as_slice()]);
        assert!(images(b"").await.is_empty());
    }
}
