//! Buffers of images as flat named layers: what an EXR file holds and what is compared pixel by pixel.

use super::{Axis, Buffer, Data, Info};

/// One image with named channels.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// The pass, with the number of the light or of the casting light where it has one for each:
    /// `TECHNIQUE.direct.light0`, `TECHNIQUE.shadow.caster0`.
    pub name: String,
    /// In pixels.
    pub width: usize,
    /// In pixels; a cube's six faces are stacked downward.
    pub height: usize,
    /// In the pass's order.
    pub channels: Vec<Channel>,
}

impl Layer {
    /// Whether another layer has the same size, and channels of the same names and types in the same order:
    /// whether the two can be compared pixel by pixel.
    pub fn same_form(&self, other: &Self) -> bool {
        let form = |layer: &Self| -> Vec<_> {
            let channels = layer.channels.iter();
            channels
                .map(|channel| (channel.name.clone(), channel.data.type_name(), channel.data.len()))
                .collect()
        };
        (self.width, self.height) == (other.width, other.height) && form(self) == form(other)
    }
}

/// One channel of a layer.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Such as `R`, or `Y` where a pass has one channel without a name.
    pub name: String,
    /// `width × height` values, the top row first.
    pub data: Data,
}

/// The layers of a pass's buffer: one a light where it has a light axis, else one.
///
/// # Panics
/// Where the pass is no image ([`Info::is_image`]).
pub fn layers(info: &Info, buffer: &Buffer) -> Vec<Layer> {
    assert!(info.is_image(), "{} is no image", info.name);
    let length = |wanted: Axis| {
        info.axes.iter().position(|axis| *axis == wanted).map_or(1, |position| buffer.shape[position])
    };
    let numbered = matches!(info.axes[0], Axis::Light | Axis::Caster).then(|| info.axes[0].label());
    let count = if numbered.is_some() { buffer.shape[0] } else { 1 };
    let (width, height) = (length(Axis::Column), length(Axis::Face) * length(Axis::Row));
    let names: &[&str] = match info.axes.last() {
        Some(Axis::Channel(names)) => names,
        _ => &["Y"],
    };
    (0..count)
        .map(|number| {
            let channels = names.iter().enumerate().map(|(channel, name)| Channel {
                name: (*name).into(),
                data: strided(&buffer.data, number * width * height, width * height, names.len(), channel),
            });
            let name = match &numbered {
                Some(axis) => format!("{}.{axis}{number}", info.name),
                None => info.name.into(),
            };
            Layer { name, width, height, channels: channels.collect() }
        })
        .collect()
}

fn strided(data: &Data, first: usize, count: usize, stride: usize, offset: usize) -> Data {
    fn pick<T: Copy>(values: &[T], first: usize, count: usize, stride: usize, offset: usize) -> Vec<T> {
        values[first * stride..(first + count) * stride]
            .iter()
            .skip(offset)
            .step_by(stride)
            .copied()
            .collect()
    }
    match data {
        Data::F32(values) => Data::F32(pick(values, first, count, stride, offset)),
        Data::U32(values) => Data::U32(pick(values, first, count, stride, offset)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lights_become_layers_and_faces_are_stacked() {
        let axes = &[Axis::Light, Axis::Face, Axis::Row, Axis::Column, Axis::Channel(&["a", "b"])];
        let info = Info { name: "t.cube", axes, ..Info::BLANK };
        let values: Vec<f32> = (0..2 * 6 * 2 * 3 * 2).map(|i| i as f32).collect();
        let layers = layers(&info, &Buffer::f32(&[2, 6, 2, 3, 2], values));
        assert_eq!(layers.len(), 2);
        assert_eq!((layers[1].name.as_str(), layers[1].width, layers[1].height), ("t.cube.light1", 3, 12));
        let Data::F32(second) = &layers[1].channels[1].data else { panic!() };
        assert_eq!(&second[..3], [73.0, 75.0, 77.0]);
    }
}
