"""Layout of rope chains on a garment: from its pinned rim down to the hem."""
