"""Quality for control: an exported GA-CNN, run on the CPU by OpenVINO."""

import sys
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from pipeline.errors import ContentError
from pipeline.network.control_input import control_input
from pipeline.network.exported import REMEDY, check_onnx_bytes
from pipeline.network.input_channels import CHANNELS, SYMMETRIES

# Importing openvino tells Google Analytics and leaves an identifier in the home folder, except
# where this package is missing.
sys.modules["openvino_telemetry"] = None  # type: ignore[assignment]
import openvino  # noqa: E402

# Grasps a stream takes at a time. With 4 a grasp costs some 6 % more; with 16 some 4 % less, but
# two streams are then unequally busy with the 48 candidates of a control step.
_PART = 8


class ControlPredictor:
    """An exported network, loaded and ready to predict quality for control.

    A grasp's quality is the same bytes whichever grasps are asked with it, on any number of
    threads: each part of a batch is of one size and run by one thread.
    """

    def __init__(self, data: bytes, threads: int) -> None:
        """Load an exported network.

        Parameters
        ----------
        data
            Bytes that ``export_onnx_bytes`` made.
        threads
            Threads of the CPU to run on.

        Raises
        ------
        ContentError
            The bytes are no such export, or of another version.
        """
        taken = check_onnx_bytes(data)
        self._channels, self._cells = taken.channels, taken.cells
        try:
            compiled = _compiled(data, (len(self._channels), self._cells, self._cells), threads)
        # Its messages may quote the bytes of a damaged model, which need not be text.
        except (RuntimeError, UnicodeDecodeError) as error:
            reason = str(error).strip().rpartition("\n")[2]
            raise ContentError(f"exported network cannot be run: {reason}", REMEDY) from error
        self._streams = openvino.AsyncInferQueue(compiled, threads)
        self._streams.set_callback(_take_quality)

    def predict(
        self,
        cloud: Float[np.ndarray, "n h w 3"],
        mask: Bool[np.ndarray, "n h w"],
        average_symmetries: bool = False,
    ) -> Float[np.ndarray, " n"]:
        """Predicted quality q̂ in [0, 1].

        Parameters
        ----------
        cloud
            Points in GCS in units of r_G, shape (n, h, w, 3), grid as in ``canonical``.
        mask
            Cells that hold a measured point, shape (n, h, w).
        average_symmetries
            Mean over the eight turns and mirrors under which q does not change.

        Returns
        -------
        q̂ in single precision, shape (n,).

        Raises
        ------
        ContentError
            The clouds have other cells than the network was trained on.
        """
        if cloud.shape[1:3] != (self._cells, self._cells):
            raise ContentError(
                f"clouds of {cloud.shape[1]} by {cloud.shape[2]} cells, and the network takes "
                f"{self._cells} by {self._cells}",
                "Set sensing.grid_cells to what the network was trained on, or train another",
            )
        turns = SYMMETRIES if average_symmetries else 1
        predicted = np.empty((turns, len(cloud)), dtype=np.float32)
        for start in range(0, len(cloud), _PART):
            some = slice(start, start + _PART)
            part = self._input(cloud[some], mask[some])
            if len(part) < _PART:
                part = np.pad(part, ((0, _PART - len(part)), (0, 0), (0, 0), (0, 0)))
            for element in range(turns):
                turned = self._turned(part, element) if element else part
                self._streams.start_async({0: turned}, predicted[element, some])
        self._streams.wait_all()
        mean: Float[np.ndarray, " n"] = predicted.mean(axis=0)
        return mean

    def _input(
        self, cloud: Float[np.ndarray, "n h w 3"], mask: Bool[np.ndarray, "n h w"]
    ) -> Float[np.ndarray, "n c h w"]:
        """The network's input; for older channels the tensor version, which is slower."""
        if self._channels == CHANNELS:
            return control_input(cloud, mask)
        # PyTorch takes seconds to import, and only networks of version 0.1.0 need it here.
        from pipeline.network.tensor_input import tensor_input

        return tensor_input(cloud, mask, self._channels)

    def _turned(
        self, part: Float[np.ndarray, "n c h w"], element: int
    ) -> Float[np.ndarray, "n c h w"]:
        """An input under one symmetry of the square; see `apply_symmetry`."""
        # As above: only what measures a network averages; control never does.
        from pipeline.network.tensor_input import turned_input

        return turned_input(part, element, self._channels)


def _compiled(data: bytes, input_shape: tuple[int, ...], threads: int) -> openvino.CompiledModel:
    """A checked export for parts of one size, in as many streams of one thread each."""
    core = openvino.Core()
    model = core.read_model(data)
    model.reshape([_PART, *input_shape])
    compiled = core.compile_model(
        model,
        "CPU",
        {
            "NUM_STREAMS": threads,
            "INFERENCE_NUM_THREADS": threads,
            # Where the CPU has bfloat16 it would be taken.
            "INFERENCE_PRECISION_HINT": "f32",
            # Workers side by side would all be pinned to the same cores.
            "ENABLE_CPU_PINNING": False,
        },
    )
    given = [tuple(output.shape) for output in compiled.outputs]
    if given != [(_PART,)]:
        raise RuntimeError(f"of {_PART} grasps it gives {given}, not a quality each")
    return compiled


def _take_quality(request: Any, into: Float[np.ndarray, " n"]) -> None:
    """Keep a part's quality, without that of its padding.

    ``request`` is an InferRequest of OpenVINO's inner kind, which has no public name.
    """
    into[:] = request.get_output_tensor(0).data[: len(into)]
