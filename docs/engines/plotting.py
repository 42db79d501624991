"""Renders a ball and a floor under three lights in VTK, MuJoCo, pygfx and matplotlib.

    pip install vtk==9.7.2 mujoco==4.0.0 pygfx==0.17.0 rendercanvas matplotlib==3.11.2 pillow
    MUJOCO_GL=egl python docs/engines/plotting.py tests/heuristic/pictures

writes ``NAME.png`` there. ``tests/heuristic/test_plotting.py`` compares them with the stand-ins.
VTK and MuJoCo need EGL, pygfx a Vulkan driver such as Mesa's.
"""

import sys
from pathlib import Path

import numpy as np

WIDTH, HEIGHT = 160, 120
BALL, FLOOR = (0.8, 0.4, 0.2), (0.3, 0.5, 0.7)
"""Codes of sRGB: a ball of radius 1 on a floor of 8 x 8 in the plane y = 0."""
HIGHLIGHT, EXPONENT = 0.4, 20
LIGHTS = {
    (4, 5, 4): (0.7, 0.7, 0.7),
    (-5, 3, 2): (0.5, 0.2, 0.2),
    (0, 6, -4): (0.2, 0.3, 0.5),
}
"""Positions and colours."""
AMBIENT = 0.1
EYE, TARGET, FOV = (0, 3, 7), (0, 0.7, 0), 40
"""The angle is the picture's height."""
ELEVATION, SCALE = 25, 20.0
"""Of matplotlib's view without perspective: degrees, and pixels for a unit."""


def vtk_picture():
    """Draw it with VTK."""
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy

    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(WIDTH, HEIGHT)
    renderer = vtk.vtkRenderer()
    window.AddRenderer(renderer)
    ball = vtk.vtkSphereSource()
    ball.SetThetaResolution(128)
    ball.SetPhiResolution(64)
    ball.SetRadius(1)
    ball.SetCenter(0, 1, 0)
    floor = vtk.vtkPlaneSource()
    floor.SetOrigin(-4, 0, -4)
    floor.SetPoint1(-4, 0, 4)
    floor.SetPoint2(4, 0, -4)
    for source, colour in ((ball, BALL), (floor, FLOOR)):
        mapper = vtk.vtkPolyDataMapper()
        mapper.SetInputConnection(source.GetOutputPort())
        actor = vtk.vtkActor()
        actor.SetMapper(mapper)
        look = actor.GetProperty()
        look.SetColor(*colour)
        look.SetAmbient(AMBIENT)
        look.SetSpecular(HIGHLIGHT)
        look.SetSpecularPower(EXPONENT)
        look.SetInterpolationToPhong()
        renderer.AddActor(actor)
    for position, colour in LIGHTS.items():
        light = vtk.vtkLight()
        light.SetLightTypeToSceneLight()
        light.SetPositional(True)
        light.SetConeAngle(180)
        light.SetPosition(*position)
        light.SetColor(*colour)
        renderer.AddLight(light)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(*EYE)
    camera.SetFocalPoint(*TARGET)
    camera.SetViewAngle(FOV)
    renderer.ResetCameraClippingRange()
    window.Render()
    shot = vtk.vtkWindowToImageFilter()
    shot.SetInput(window)
    shot.Update()
    pixels = vtk_to_numpy(shot.GetOutput().GetPointData().GetScalars())
    return pixels.reshape(HEIGHT, WIDTH, -1)[::-1]


def mujoco_picture():
    """Draw it with MuJoCo, whose z is up; with the headlight that every model has."""
    import mujoco

    def words(*numbers):
        return " ".join(f"{number:.9g}" for number in numbers)

    def turned(point):
        x, y, z = point
        return words(x, -z, y)

    look = f'specular="{HIGHLIGHT}" shininess="{EXPONENT / 128}"'
    lights = "".join(
        f'<light pos="{turned(position)}" cutoff="180" castshadow="false"'
        f' diffuse="{words(*colour)}" specular="{words(*colour)}"/>'
        for position, colour in LIGHTS.items()
    )
    back = np.subtract(EYE, TARGET) / np.linalg.norm(np.subtract(EYE, TARGET))
    up = np.cross(back, (1, 0, 0))
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco>
        <visual>
          <global offwidth="{WIDTH}" offheight="{HEIGHT}"/>
          <quality numslices="128" numstacks="64" numquads="50"/>
        </visual>
        <asset>
          <material name="ball" rgba="{words(*BALL)} 1" {look}/>
          <material name="floor" rgba="{words(*FLOOR)} 1" {look}/>
        </asset>
        <worldbody>
          {lights}
          <geom type="sphere" size="1" pos="0 0 1" material="ball"/>
          <geom type="plane" size="4 4 1" material="floor"/>
          <camera name="eye" fovy="{FOV}" pos="{turned(EYE)}" xyaxes="1 0 0 {turned(up)}"/>
        </worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    renderer = mujoco.Renderer(model, HEIGHT, WIDTH)
    renderer.update_scene(data, "eye")
    return renderer.render()


def pygfx_picture():
    """Draw it with pygfx, whose field of view is the mean of both, as lengths."""
    import pygfx
    from rendercanvas.offscreen import RenderCanvas

    def code(light):
        return tuple(1.055 * np.power(light, 1 / 2.4) - 0.055)

    canvas = RenderCanvas(size=(WIDTH, HEIGHT), pixel_ratio=1)
    renderer = pygfx.renderers.WgpuRenderer(canvas)
    scene = pygfx.Scene()
    look = {"specular": code([HIGHLIGHT] * 3), "shininess": EXPONENT}
    ball = pygfx.Mesh(
        pygfx.sphere_geometry(1, 128, 64), pygfx.MeshPhongMaterial(color=(*BALL, 1), **look)
    )
    ball.local.position = (0, 1, 0)
    floor = pygfx.Mesh(
        pygfx.plane_geometry(8, 8), pygfx.MeshPhongMaterial(color=(*FLOOR, 1), **look)
    )
    floor.local.euler_x = -np.pi / 2
    scene.add(ball, floor)
    for position, colour in LIGHTS.items():
        light = pygfx.PointLight(color=code(colour))
        light.local.position = position
        scene.add(light)
    half = np.tan(np.radians(FOV / 2)) * (1 + WIDTH / HEIGHT) / 2
    camera = pygfx.PerspectiveCamera(2 * np.degrees(np.arctan(half)), WIDTH / HEIGHT)
    camera.local.position = EYE
    camera.look_at(TARGET)
    canvas.request_draw(lambda: renderer.render(scene, camera))
    return np.asarray(canvas.draw())[..., :3]


def matplotlib_picture():
    """Draw it with matplotlib for each light in turn, side by side: a surface has one light."""
    import matplotlib as mpl

    mpl.use("agg")
    from matplotlib import pyplot
    from matplotlib.colors import LightSource
    from mpl_toolkits.mplot3d import proj3d

    theta, phi = np.meshgrid(np.linspace(0, np.pi, 65), np.linspace(0, 2 * np.pi, 129))
    ball = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), 1 + np.cos(theta)
    x, y = np.meshgrid([-3, 0, 3], [-3, 0, 3])
    pictures = []
    for place in LIGHTS:
        east, north, up = place[0], -place[2], place[1]
        light = LightSource(
            azdeg=np.degrees(np.arctan2(east, north)),
            altdeg=np.degrees(np.arctan2(up, np.hypot(east, north))),
        )
        figure = pyplot.figure(figsize=(WIDTH / 100, HEIGHT / 100), dpi=100, facecolor="black")
        axes = figure.add_axes(
            (0, 0, 1, 1), projection="3d", proj_type="ortho", computed_zorder=False
        )
        axes.set_axis_off()
        axes.set_facecolor("black")
        how = {"lightsource": light, "antialiased": False, "linewidth": 0}
        axes.plot_surface(x, y, 0 * x, color=FLOOR, zorder=1, **how)
        axes.plot_surface(*ball, color=BALL, rcount=200, ccount=200, zorder=2, **how)
        axes.set(xlim=(-3, 3), ylim=(-3, 3), zlim=(-3, 3))
        axes.view_init(elev=ELEVATION, azim=-90)
        axes.set_box_aspect((1, 1, 1))

        def pixel(*point, axes=axes):
            flat = proj3d.proj_transform(*point, axes.get_proj())
            return np.array(axes.transData.transform(flat[:2]))

        # The view is moved and scaled so that the origin lies in the middle.
        figure.canvas.draw()
        length = (pixel(1, 0, 0) - pixel(0, 0, 0))[0]
        axes.set_box_aspect((1, 1, 1), zoom=SCALE / length)
        figure.canvas.draw()
        right, above = (np.array([WIDTH, HEIGHT]) / 2 - pixel(0, 0, 0)) / (WIDTH, HEIGHT)
        axes.set_position((right, above, 1, 1))
        figure.canvas.draw()
        np.testing.assert_allclose(pixel(0, 0, 0), (WIDTH / 2, HEIGHT / 2), atol=0.01)
        np.testing.assert_allclose(pixel(1, 0, 0)[0] - pixel(0, 0, 0)[0], SCALE, rtol=1e-3)
        pictures.append(np.array(figure.canvas.buffer_rgba())[..., :3])
        pyplot.close(figure)
    return np.hstack(pictures)


PICTURES = {
    "vtk": vtk_picture,
    "mujoco": mujoco_picture,
    "pygfx": pygfx_picture,
    "matplotlib": matplotlib_picture,
}

if __name__ == "__main__":
    from PIL import Image

    for name, picture in PICTURES.items():
        Image.fromarray(np.ascontiguousarray(picture())).save(Path(sys.argv[1], f"{name}.png"))
