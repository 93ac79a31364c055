"""Ask questions about a video and get probabilities."""

from pathlib import Path

import vrdp_prob

VIDEO = Path(__file__).parent / "demo" / "video_00000.mp4"


def main() -> None:
    tracks = vrdp_prob.load(VIDEO)
    # The fast way, which says how far it can be trusted; without both options the draws take a minute and can be.
    posterior = vrdp_prob.infer(tracks, sampler="laplace", hand_on=False, seed=1)
    print(posterior.convergence.sentence)

    answer = posterior.ask("How many collisions happen?")
    print(answer.question)
    for value, probability in answer.distribution.items():
        print(f"  {probability:6.1%}  {value}")

    answer = posterior.ask(
        "Which of the following will happen without the cyan sphere?",
        choices=["The gray cylinder and the purple cube collide", "The green sphere and the purple cube collide"],
    )
    print(answer.question)
    for choice in answer.choices:
        print(f"  {choice.probability:6.1%} ± {choice.mc_error:.1%}  {choice.choice}")


if __name__ == "__main__":
    main()
