"""The variant of a scene for hosts that cannot close joints: a spring and a damper in place of each closing joint."""

from dataclasses import replace

from .definition import Scene

#: Root file of the variant.
FILE = "foreign.ssd"


def compliant(scene: Scene, *, stiffness: float, damping: float, H: float, order: int = 1) -> Scene:
    """The scene with a `bushing` (`stiffness` [N/m], `damping` [N.s/m]) in place of each closing joint, by plain exchange.

    The motion differs from that of the joints by the bushings' elongation. Close the FMUs of `scene` first or last: both
    scenes use them.
    """
    variant = Scene(scene.name, scene.fmus)
    variant.components = dict(scene.components)
    variant.connect_all(scene.connections)
    for number, joint in enumerate(scene.joints, 1):
        name = f"bushing{number}"
        variant.add(name, "bushing", stiffness=stiffness, damping=damping)
        variant.connect(joint.first, f"{name}.A")
        variant.connect(joint.second, f"{name}.B")
    variant.recorded, variant.interval = list(scene.recorded), scene.interval
    variant.start, variant.stop = scene.start, scene.stop
    variant.norms = dict(scene.norms)
    variant.settings = replace(scene.settings, method="jacobi", H=H, order=order, step=None)
    return variant
