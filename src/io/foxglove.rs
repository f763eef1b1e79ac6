//! The two image messages of the Foxglove schemas as protobuf, with the schema description for a
//! recording.

use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet, Timestamp,
};

/// Name of the schema of [`CompressedImage`].
pub const COMPRESSED_IMAGE: &str = "foxglove.CompressedImage";
/// Name of the schema of [`RawImage`].
pub const RAW_IMAGE: &str = "foxglove.RawImage";

const TIMESTAMP: &str = ".google.protobuf.Timestamp";
const TIMESTAMP_FILE: &str = "google/protobuf/timestamp.proto";
/// Nanoseconds of a second. By definition.
const NS_PER_S: u64 = 1_000_000_000;

/// `foxglove.CompressedImage`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct CompressedImage {
    /// Time of capture.
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// Frame of reference of the camera.
    #[prost(string, tag = "4")]
    pub frame_id: String,
    /// Bytes of an image file.
    #[prost(bytes = "vec", tag = "2")]
    pub data: Vec<u8>,
    /// Format of the image file, such as `png`.
    #[prost(string, tag = "3")]
    pub format: String,
}

/// `foxglove.RawImage`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct RawImage {
    /// Time of capture.
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// Frame of reference of the camera.
    #[prost(string, tag = "7")]
    pub frame_id: String,
    /// Width \[px\].
    #[prost(fixed32, tag = "2")]
    pub width: u32,
    /// Height \[px\].
    #[prost(fixed32, tag = "3")]
    pub height: u32,
    /// Encoding of the pixels, such as `mono8`.
    #[prost(string, tag = "4")]
    pub encoding: String,
    /// Bytes from one row to the next.
    #[prost(fixed32, tag = "5")]
    pub step: u32,
    /// Bytes of the rows.
    #[prost(bytes = "vec", tag = "6")]
    pub data: Vec<u8>,
}

/// A timestamp from nanoseconds since 1970.
pub fn timestamp(ns: u64) -> Timestamp {
    Timestamp {
        seconds: i64::try_from(ns / NS_PER_S).unwrap_or(i64::MAX),
        nanos: i32::try_from(ns % NS_PER_S).unwrap_or(0),
    }
}

/// Nanoseconds since 1970; `None` for an unset or invalid timestamp. Zero counts as unset: many
/// writers leave it.
pub fn timestamp_ns(stamp: Option<&Timestamp>) -> Option<u64> {
    let stamp = stamp?;
    let seconds = u64::try_from(stamp.seconds).ok()?;
    let nanos = u64::try_from(stamp.nanos).ok()?;
    let ns = seconds.checked_mul(NS_PER_S)?.checked_add(nanos)?;
    (ns > 0).then_some(ns)
}

/// The schema record of [`CompressedImage`]: a `FileDescriptorSet` with all descriptions that it
/// refers to.
pub fn compressed_image_schema() -> Vec<u8> {
    let fields = vec![
        field("timestamp", 1, Type::Message, Some(TIMESTAMP)),
        field("frame_id", 4, Type::String, None),
        field("data", 2, Type::Bytes, None),
        field("format", 3, Type::String, None),
    ];
    let mut image = file("foxglove/CompressedImage.proto", "foxglove", "CompressedImage", fields);
    image.dependency = vec![TIMESTAMP_FILE.into()];
    let fields = vec![field("seconds", 1, Type::Int64, None), field("nanos", 2, Type::Int32, None)];
    let timestamp = file(TIMESTAMP_FILE, "google.protobuf", "Timestamp", fields);
    FileDescriptorSet { file: vec![timestamp, image] }.encode_to_vec()
}

/// A file descriptor with one message.
fn file(
    name: &str,
    package: &str,
    message: &str,
    field: Vec<FieldDescriptorProto>,
) -> FileDescriptorProto {
    let name_of = |name: &str| Some(name.to_owned());
    FileDescriptorProto {
        name: name_of(name),
        package: name_of(package),
        message_type: vec![DescriptorProto { name: name_of(message), field, ..Default::default() }],
        syntax: name_of("proto3"),
        ..Default::default()
    }
}

fn field(name: &str, number: i32, kind: Type, of: Option<&str>) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name.into()),
        number: Some(number),
        label: Some(Label::Optional.into()),
        r#type: Some(kind.into()),
        type_name: of.map(Into::into),
        json_name: Some(if name == "frame_id" { "frameId".into() } else { name.into() }),
        ..FieldDescriptorProto::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_timestamp_keeps_its_nanoseconds() {
        let ns = 1_763_683_200_123_456_789;
        assert_eq!(timestamp_ns(Some(&timestamp(ns))), Some(ns));
    }

    #[test]
    fn an_impossible_timestamp_is_none() {
        assert_eq!(timestamp_ns(None), None);
        assert_eq!(timestamp_ns(Some(&Timestamp { seconds: 0, nanos: 0 })), None);
        assert_eq!(timestamp_ns(Some(&Timestamp { seconds: -1, nanos: 0 })), None);
        assert_eq!(timestamp_ns(Some(&Timestamp { seconds: i64::MAX, nanos: 1 })), None);
    }
}
