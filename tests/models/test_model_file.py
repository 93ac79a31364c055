"""Models as files."""

import importlib
import math
import re
from dataclasses import replace
from pathlib import Path

import pytest

from vrdp_prob.errors import InputError
from vrdp_prob.inference import default_model
from vrdp_prob.models.effects.bowl import Bowl
from vrdp_prob.models.effects.material_friction import MATERIAL_RATIO, MaterialFriction
from vrdp_prob.models.model_file import known_effects
from vrdp_prob.models.parameters import MASS, RESTITUTION, SLIDING_FRICTION, WALL_RESTITUTION, belief_key
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.scene import Wall


def test_write_then_read_gives_the_same(tmp_path: Path) -> None:
    belief = replace(SLIDING_FRICTION, default=0.25, prior=replace(SLIDING_FRICTION.prior, sd=0.3))
    model = PhysicsModel("mine", PhysicsModel.base().effects, {"sliding_friction": belief})
    model.write(str(tmp_path / "model.toml"))
    again = PhysicsModel.read(str(tmp_path / "model.toml"))
    assert again.name == "mine"
    assert [effect.name for effect in again.effects] == [effect.name for effect in model.effects]
    assert again.parameters == model.parameters
    assert belief in again.parameters


def test_a_model_may_believe_something_of_masses_and_restitutions(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    path.write_text('name = "balls"\neffects = ["dry_friction"]\n[parameters.mass]\ndefault = 0.2\nprior_sd = 0.01\n')
    model = PhysicsModel.read(path)
    assert model.believed(MASS) == replace(MASS, default=0.2, prior=replace(MASS.prior, sd=0.01))
    assert model.believed(RESTITUTION) == RESTITUTION
    assert MASS.name not in [parameter.name for parameter in model.parameters]
    model.write(path)
    assert PhysicsModel.read(path).believed(MASS) == model.believed(MASS)
    assert model.with_effect(Bowl()).without_effect(model.effects[0]).believed(MASS).default == 0.2


def test_a_model_may_believe_something_of_one_material_and_of_one_wall(tmp_path: Path) -> None:
    wall, other = Wall(1.0, -2.0, 1.0, 2.0), Wall(0.0, 0.0, 3.0, 0.0)
    ratio = replace(MATERIAL_RATIO, default=1.4, prior=replace(MATERIAL_RATIO.prior, mean=math.log(1.4), sd=0.02))
    rebound = replace(WALL_RESTITUTION, default=0.6, prior=replace(WALL_RESTITUTION.prior, mean=math.log(0.6), sd=0.03))
    beliefs = {belief_key(ratio.name, ("metal",)): ratio, belief_key(rebound.name, wall.place): rebound}
    model = PhysicsModel("table", PhysicsModel.base().with_effect(MaterialFriction()).effects, beliefs)
    model.write(tmp_path / "model.toml")
    again = PhysicsModel.read(tmp_path / "model.toml")
    assert again.text == model.text
    assert again.believed(MATERIAL_RATIO, ("metal",)) == ratio
    assert again.believed(MATERIAL_RATIO, ("rubber",)) == again.believed(MATERIAL_RATIO) == MATERIAL_RATIO
    assert (
        again.believed(WALL_RESTITUTION, replace(wall, x1=wall.x2, y1=wall.y2, x2=wall.x1, y2=wall.y1).place) == rebound
    )
    assert again.believed(WALL_RESTITUTION, other.place) == WALL_RESTITUTION
    assert set(again.without_effect(MaterialFriction()).beliefs) & set(beliefs) == {
        belief_key(rebound.name, wall.place)
    }


def test_a_person_may_write_the_ends_of_a_wall_in_either_order(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    table = '[parameters."wall_restitution[1.20,-0.6, -1.1234567,0]"]\nprior_mean = -0.5\n'
    path.write_text(f'name = "a"\neffects = ["air_drag"]\n{table}[parameters.wall_restitution]\nprior_sd = 0.05\n')
    believed = PhysicsModel.read(path).believed(WALL_RESTITUTION, Wall(-1.1234567, 0.0, 1.2, -0.6).place)
    assert (believed.prior.mean, believed.prior.sd) == (-0.5, 0.05)


def test_every_effect_of_the_catalogue_can_be_named(tmp_path: Path) -> None:
    names = sorted(known_effects())
    assert {"dry_friction", "air_drag", "angular_drag", "normal_impact"} <= set(names)
    for name in names:
        path = tmp_path / f"{name}.toml"
        path.write_text(f'name = "one"\neffects = ["{name}"]\n')
        assert PhysicsModel.read(path).effects[0].name == name


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("name = ", "not a TOML file"),
        ('effects = ["air_drag"]', "field 'name' is missing"),
        ('name = "a"', "field 'effects' is missing"),
        ('name = "a"\neffects = ["ether"]', "effect 'ether' is not known; the effects are air_drag"),
        ('name = "a"\neffects = ["air_drag", "air_drag"]', "an effect appears twice"),
        ('name = "a"\neffects = ["air_drag"]\ncolour = 1', "field 'colour' is not known"),
        ('name = "a"\neffects = ["air_drag"]\n[parameters.tilt_x]', "parameter 'tilt_x' belongs to none"),
        ('name = "a"\neffects = ["air_drag"]\n[parameters.air_drag]\nprior_sd = "x"', "air_drag.prior_sd' is 'x'"),
        ('name = "a"\neffects = ["air_drag"]\n[parameters.air_drag]\nprior_sd = nan', "give a finite number"),
        ('name = "a"\neffects = ["air_drag"]\n[parameters.air_drag]\nprior_sd = -1', "sd positive"),
        ('name = "a"\neffects = ["air_drag"]\n[parameters.air_drag]\ndefault = -1', "outside its support"),
        ('name = "a"\neffects = ["air_drag"]\n[parameters.air_drag]\nshape = 1', "air_drag.shape' is not known"),
        ('name = "a"\neffects = ["air_drag"]\n[parameters."air_drag[metal]"]', "is of no material or wall"),
        ('name = "a"\neffects = ["air_drag"]\n[parameters."wall_restitution[1, 2"]', "belongs to none"),
        ('name = "a"\neffects = ["air_drag"]\n[parameters."wall_restitution[1, 2, 3]"]', "name the wall by its ends"),
        ('name = "a"\neffects = ["air_drag"]\n[parameters."wall_restitution[1, 2, 3, 4, 5]"]', "by its ends"),
    ],
)
def test_mistakes_name_file_and_field(tmp_path: Path, content: str, message: str) -> None:
    path = tmp_path / "model.toml"
    path.write_text(content)
    with pytest.raises(InputError, match=message) as caught:
        PhysicsModel.read(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_example_of_the_documentation_is_a_model(tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "docs" / "effects.md").read_text(encoding="utf-8")
    path = tmp_path / "model.toml"
    path.write_text(text.split("```toml\n")[1].split("```")[0], encoding="utf-8")
    model = PhysicsModel.read(path)
    assert model.name == default_model().name
    assert [effect.name for effect in model.effects] == [effect.name for effect in default_model().effects]


def test_the_documentation_lists_every_effect_with_where_it_does_nothing_and_its_sentence() -> None:
    text = (Path(__file__).parents[2] / "docs" / "effects.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \| .* \| (.*) \| (.*) \| .* \|$", text, flags=re.MULTILINE)
    told = {name: (nothing, sentence) for name, nothing, sentence in rows}
    assert told.keys() == known_effects().keys()
    for name, kind in known_effects().items():
        effect = kind()
        values = [f"`{one}` = {value:g}" for one, value in effect.vanishes_at.items()]
        values += [f"`{one}` = `{other}`" for one, other in effect.vanishes_like.items()]
        assert told[name] == (", ".join(values) or "-", effect.sentence)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        PhysicsModel.read(tmp_path / "none.toml")


OWN = """
from vrdp_prob.models.effects.linear_drag import LinearDrag

class Syrup(LinearDrag):
    name = "syrup"

NUMBER = 3
"""


def test_an_effect_of_another_module_is_named_with_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "my_effects.py").write_text(OWN, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    syrup = importlib.import_module("my_effects").Syrup
    path = tmp_path / "model.toml"
    PhysicsModel.base().with_effect(syrup()).write(path)
    assert '"my_effects:Syrup"' in path.read_text(encoding="utf-8")
    assert isinstance(PhysicsModel.read(path).effects[-1], syrup)


@pytest.mark.parametrize(
    ("reference", "sentence"),
    [
        ("no_such_module:Syrup", "cannot be imported"),
        ("math:Syrup", "cannot be imported"),
        ("math:pi", "no subclass of Effect"),
        (":Syrup", "cannot be imported"),
    ],
)
def test_a_wrong_module_is_one_sentence(tmp_path: Path, reference: str, sentence: str) -> None:
    path = tmp_path / "model.toml"
    path.write_text(f'name = "one"\neffects = ["{reference}"]\n', encoding="utf-8")
    with pytest.raises(InputError, match=sentence):
        PhysicsModel.read(path)
