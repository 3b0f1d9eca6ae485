"""A person at the screen, played by a simulated participant; and the events of a log."""

from study.participants.observer_catalogue import find_observer
from study.session.views.form_views import FormKind, FormReply
from study.session.views.participant_views import AfterPause, DemoDone, PlayDemo
from study.store.sessions.event_log import read_log
from study.workflows.session.simulated_display import SimulatedDisplay


class Person(SimulatedDisplay):
    """Answers like a simulated participant, and does what a test wants at each other call."""

    def __init__(self, clock, seed=11):
        super().__init__(find_observer("ideal", seed), seed, clock)
        self.calls, self.questions, self.playing, self.told, self.welcomes = [], [], [], [], []
        self.at_question = lambda question: None
        self.at_pause = lambda: None
        self.demo = [PlayDemo(1, 1), PlayDemo(2, 2), DemoDone()]
        self.refuse = None
        self.decisions = []

    def fill_in(self, form):
        self.calls.append(form.kind)
        if form.kind is FormKind.EXCLUSION:
            return FormReply({field.key: "yes" if self.refuse is form.kind else "no" for field in form.fields})
        reply = super().fill_in(form)
        return FormReply(dict.fromkeys(reply.answers, "no")) if self.refuse is form.kind else reply

    def device_checked(self, report):
        self.calls.append("device")
        return True

    def welcome(self, notice):
        self.calls.append("welcome")
        self.welcomes.append(notice)

    def choose_demo(self, menu, sign_of_life):
        self.calls.append("demo")
        return self.demo.pop(0)

    def show_playing(self, notice, sign_of_life):
        self.playing.append(notice)
        return super().show_playing(notice, sign_of_life)

    def ask(self, question, sign_of_life):
        self.questions.append(question)
        self.at_question(question)
        return super().ask(question, sign_of_life)

    def practice_over(self, result):
        self.calls.append(result)

    def pause(self, notice, sign_of_life):
        self.calls.append(notice.reason)
        self.at_pause()
        if not sign_of_life():
            return AfterPause.END_SITTING
        return self.decisions.pop(0) if self.decisions else AfterPause.CONTINUE_SITTING

    def trouble(self, sentence):
        self.told.append(sentence)


def of(end, kind):
    return [event for event in read_log(end.folder.log).events if isinstance(event, kind)]
