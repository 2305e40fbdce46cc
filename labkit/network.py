"""The networks and their weights at their public address; `labkit.learning.network` has their text (topic 03)."""

from labkit.learning.network import (
    ARCHITECTURES,
    SmallSegNet,
    TorchEngine,
    UNet,
    UNetRGBD,
    load_model,
    save_model,
    weights_path,
)
