"""Networks, bases and regressions that several animators learn with; `fit` trains them, with torch."""

from .key_frame import to_key_frame as to_key_frame
from .mlp import Mlp as Mlp
from .packed_basis import PackedBasis as PackedBasis
from .packed_basis import pack_basis as pack_basis
from .pca import Pca as Pca
from .pca import principal_of_map as principal_of_map
from .ridge import ridge as ridge

__all__ = ["Mlp", "PackedBasis", "Pca", "pack_basis", "principal_of_map", "ridge", "to_key_frame"]
